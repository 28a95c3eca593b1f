"""The figures of the README's table, measured: `make bench`."""
