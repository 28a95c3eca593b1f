"""
The one error tree: everything the package refuses, it refuses with one of these.

    ActiveReconError
    ├── ConfigError       a parameter, option or configuration key that cannot be used
    ├── DataError         a file on disk that is missing, truncated or contradicts itself
    │   ├── MeshError     a mesh that is empty, has no faces, or is no mesh
    │   └── WeightsError  a weights file that is missing, truncated or of another model
    ├── ViewError         an image, camera or azimuth that cannot become a view
    │   └── MessageError  the same, found while reading a ROS message
    ├── RecordingError    a recording that cannot be begun or continued
    └── WorkError         work on many items that must stop as a whole: a full disk

A message begins with what is wrong, then says what was expected and, where it helps, what to do.
`kind` is a short stable word, under which the nodes count refusals in their diagnostics.
"""


class ActiveReconError(Exception):
    """Root of everything the package raises on purpose."""

    def __init__(self, message: str, kind: str | None = None) -> None:
        super().__init__(message)
        self.kind = kind or type(self).__name__.removesuffix('Error').lower()


class ConfigError(ActiveReconError):
    """A parameter, option or configuration key that cannot be used."""


class DataError(ActiveReconError):
    """A file on disk that is missing, truncated or contradicts itself."""


class MeshError(DataError):
    """A mesh that is empty, has no faces, or is no mesh."""


class WeightsError(DataError):
    """A weights file that is missing, truncated or of another model."""


class ViewError(ActiveReconError):
    """An image, camera or azimuth that cannot become a view."""


class MessageError(ViewError):
    """A ROS message whose content cannot be used."""


class RecordingError(ActiveReconError):
    """A recording that cannot be begun or continued."""


class WorkError(ActiveReconError):
    """Work on many items that must stop as a whole: a folder that is not seen, a full disk."""
