"""How well the quality of a reconstruction is judged: measured, fitted, tested."""
