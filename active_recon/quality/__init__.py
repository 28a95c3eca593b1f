"""How good a reconstruction is, and whether its network knows such views; numbers only."""
