"""`python -m active_recon.nodes.camera`: the camera's node."""

from active_recon.nodes.camera import main

main()
