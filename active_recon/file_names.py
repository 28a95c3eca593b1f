"""Names of files as they are compared, whatever system wrote them."""

from unicodedata import normalize


def comparable(path: str) -> str:
    """
    Return a path in small letters, with `/`, and each letter as one character.

    macOS writes an umlaut as two characters, others as one.
    """
    return normalize('NFC', path.replace('\\', '/')).lower()
