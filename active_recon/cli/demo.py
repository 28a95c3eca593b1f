"""`active-recon demo`: the loop of ROS 2 nodes with a simulated camera, live in the terminal."""

from pathlib import Path
from typing import Annotated

from active_recon.cli.policy_option import policy_option
from active_recon.policies import AUTO_POLICY
from active_recon.runtimes.precision import PRECISIONS
import typer


def demo(
    object_name: Annotated[str, typer.Option(
        '--object', help='bed, car, chair, sofa, table, or the path of a mesh file.')] = 'chair',
    views: Annotated[int, typer.Option(min=1, max=24, help='Number of views.')] = 5,
    policy: Annotated[str, policy_option(
        'Policy that chooses the next view; auto: attention where the model has it, else uniform.',
        also=(AUTO_POLICY,))] = AUTO_POLICY,
    model: Annotated[str | None, typer.Option(
        help='Name of a model that ships, or a weights file; the policy attention needs '
             'lifting-large, lifting or 2d3d-attention.')
    ] = None,
    precision: Annotated[str, typer.Option(
        help=f"The network's numbers: {', '.join(PRECISIONS)}; auto: bf16 where the processor has "
             'it, else f32.')] = 'auto',
    seed: Annotated[int, typer.Option(
        min=0, help='Seed of the first view and of the policy random.')] = 0,
    output_dir: Annotated[Path, typer.Option(
        help='Folder in which the folder of the run is created.')] = Path('bags'),
    view: Annotated[bool, typer.Option(
        '--view', help='Also show the loop in the browser; it then runs until Ctrl-C.')] = False,
) -> None:
    """Reconstruct an object with a simulated camera that chooses its own next view."""
    from active_recon.demo.run import Demo, run_demo
    from active_recon.objects import find_object
    from rich.console import Console

    console = Console(markup=False, emoji=False)  # names of files may have brackets
    try:
        folder = run_demo(
            Demo(find_object(object_name), views, policy, seed, output_dir, view, model,
                 precision),
            console)
    except KeyboardInterrupt:
        console.print('interrupted; the nodes are stopped and the bag is closed')
        raise typer.Exit(130) from None
    console.print(f'the bag, the mesh and the picture are in {folder}', soft_wrap=True)
