"""Of images that come in two forms, raw and compressed, one is used."""

OTHER_FORM_AFTER_S = 1.0
"""A camera may publish each image in both forms: one is used until it is silent for so long."""


class OneForm:
    """Lets the form through that came first; `used` names it, '' before there is one."""

    def __init__(self) -> None:
        self.used = ''
        self._heard_at = 0.0

    def takes(self, form: str, now: float) -> bool:
        """Return whether an image of a form is to be used; `now` in seconds of a steady clock."""
        if self.used not in ('', form) and now - self._heard_at < OTHER_FORM_AFTER_S:
            return False
        self.used, self._heard_at = form, now
        return True
