"""Topics of the loop, as its nodes and its observers publish and receive them."""
