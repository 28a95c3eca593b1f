"""
Node of a camera without a driver: a video device, a video file, or a folder of images.

Beside it, what other nodes receive a camera with: its images, poses and faults.
"""


def main(args: list[str] | None = None) -> None:
    """Run the camera until it is asked to stop."""
    from active_recon.nodes.camera.driver import main as run  # receivers need none of it

    run(args)
