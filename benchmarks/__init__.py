"""The figures of doc/benchmarks.md, measured: `make bench`."""
