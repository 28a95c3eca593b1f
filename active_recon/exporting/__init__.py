"""Networks and policies written as ONNX graphs, for runtimes that are not torch."""
