"""The loop as its nodes and its observers receive it."""
