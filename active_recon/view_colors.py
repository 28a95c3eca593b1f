"""One colour for each view, the same wherever a run is shown."""

Color = tuple[int, int, int]
_VIEW_COLORS: tuple[Color, ...] = (
    (37, 99, 168), (217, 95, 2), (27, 136, 105), (190, 43, 110), (109, 80, 172), (140, 100, 20))


def view_color(number: int) -> Color:
    """Return the RGB colour of a view, numbered from 1; they repeat after six."""
    return _VIEW_COLORS[(number - 1) % len(_VIEW_COLORS)]
