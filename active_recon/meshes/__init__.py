"""A reconstruction as a product: its surface with colours, in files that other tools read."""
