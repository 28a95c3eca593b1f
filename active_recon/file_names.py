"""Names of files as they are compared and told, whatever system wrote them."""

from unicodedata import normalize


def comparable(path: str) -> str:
    """
    Return a path in small letters, with `/`, and each letter as one character.

    macOS writes an umlaut as two characters, others as one.
    """
    return normalize('NFC', path.replace('\\', '/')).lower()


def readable(name: str) -> str:
    """Return a name with `?` for each byte that is not of UTF-8, as every reader takes it."""
    return name.encode(errors='replace').decode()
