"""What the recorder records, and what it monitors while it records."""
