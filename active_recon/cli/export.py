"""`active-recon export`: weights as ONNX files, for runtimes that are not torch."""

from pathlib import Path
from typing import Annotated

from active_recon.errors import DataError
import typer


def export(
    weights: Annotated[str, typer.Argument(
        help='Name of a model that ships, or a .safetensors file.')],
    out: Annotated[Path | None, typer.Argument(
        help='Folder of the files; default: that of the weights, where they are looked '
             'for.')] = None,
    int8: Annotated[Path | None, typer.Option(
        help='Also write the decoder in int8, with integer ranges taken from views of this '
             'dataset of training objects.')] = None,
) -> None:
    """
    Write a network as ONNX, with its view policy and its depth refiner; or a segmenter.

    The runtimes openvino and onnxruntime run these files; without them, weights run in torch. Each
    file says in its metadata which weights it was made of, and is refused beside others. Other
    versions of torch and onnx may write other bytes. --int8 also writes the decoder of the lifting
    network for the precision int8, with integer ranges taken from views of 60 objects.

    Example: active-recon export runs/new/weights.safetensors
    """
    from active_recon.exporting.export import export as written
    from active_recon.models.weights_files import find_weights

    file = find_weights(weights)
    if int8 is not None:  # before anything is written
        from active_recon.datasets.layout import list_objects
        from active_recon.exporting.quantization import quantize, require_quantisable

        require_quantisable(file)
        objects = list_objects(int8)
        if not objects:
            raise DataError(f'{int8}: no objects: expected some training objects, whose views '
                            'tell the integer ranges, got none')
    for path in written(file, out):
        typer.echo(f'wrote {path}')
    if int8 is not None:
        typer.echo(f'wrote {quantize(file, objects, out)}')
