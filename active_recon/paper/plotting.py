"""Curves, bars, box plots and rows of tiles as RGB images; matplotlib is imported when used."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, TYPE_CHECKING

from active_recon.evaluation.statistics import Interval
import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Picture = NDArray[np.uint8]
_COLORS = ('#2563a8', '#d95f02', '#1b8869', '#be2b6e', '#6d50ac', '#8c6414', '#4b5563', '#0e7c9c',
           '#a3a300', '#000000')


@contextmanager
def canvas(width: float, height: float, columns: int = 1,
           rows: int = 1) -> Iterator[tuple['Figure', Any]]:
    """Yield a figure, its size in inches, and its axes, (rows, columns)."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context({'axes.spines.top': False, 'axes.spines.right': False, 'font.size': 9,
                     'legend.frameon': False}):
        figure = Figure(figsize=(width, height), dpi=130, layout='constrained')
        FigureCanvasAgg(figure)  # needs no display and no pyplot state
        yield figure, figure.subplots(rows, columns, squeeze=False)


def drawn(figure: 'Figure') -> Picture:
    """Return the rendered figure, (H, W, 3) uint8 RGB."""
    figure.canvas.draw()
    rgba = np.asarray(figure.canvas.buffer_rgba())  # type: ignore[attr-defined]
    return rgba[..., :3].copy()


def curves(axes: 'Axes', xs: Sequence[float], lines: Mapping[str, Sequence[Interval]],
           x_label: str, y_label: str) -> None:
    """Draw lines with their intervals as bands."""
    for number, (name, values) in enumerate(lines.items()):
        color = _COLORS[number % len(_COLORS)]
        axes.plot(xs, [value.mean for value in values], marker='o', markersize=3, label=name,
                  color=color)
        axes.fill_between(xs, [value.low for value in values], [value.high for value in values],
                          alpha=0.15, linewidth=0, color=color)
    axes.set_xticks(list(xs))
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    axes.legend(fontsize=7, loc='upper left', bbox_to_anchor=(1, 1))


def bars(axes: 'Axes', names: Sequence[str], groups: Mapping[str, Sequence[Interval]],
         y_label: str) -> None:
    """Draw bars in groups, one colour for each group, with their intervals."""
    width = 0.8 / max(len(groups), 1)
    for number, (name, values) in enumerate(groups.items()):
        at = np.arange(len(names)) + (number - (len(groups) - 1) / 2) * width
        means = np.array([value.mean for value in values])
        ends = np.array([[value.mean - value.low for value in values],
                         [value.high - value.mean for value in values]])
        axes.bar(at, means, width, yerr=np.maximum(ends, 0), label=name,
                 color=_COLORS[number % len(_COLORS)], error_kw={'linewidth': 0.7})
    axes.set_xticks(np.arange(len(names)), list(names), rotation=35, ha='right')
    axes.set_ylabel(y_label)
    if len(groups) > 1:
        axes.legend(fontsize=7, loc='upper left', bbox_to_anchor=(1, 1))


def boxes(axes: 'Axes', groups: Mapping[str, NDArray[np.float64]], y_label: str) -> None:
    """Draw a box for each group: the median as a line, the mean as a white square."""
    mean = {'marker': 's', 'markerfacecolor': 'white', 'markeredgecolor': 'black'}
    axes.boxplot(list(groups.values()), showmeans=True, meanprops=mean, showfliers=False,
                 medianprops={'color': 'black'}, patch_artist=True,
                 boxprops={'facecolor': '#b9cde4'})
    axes.set_xticks(np.arange(len(groups)) + 1, list(groups), rotation=25, ha='right')
    axes.set_ylabel(y_label)


def tiles(rows: Sequence[Sequence[Picture | None]], headings: Sequence[str],
          names: Sequence[str], notes: Sequence[Sequence[str]] | None = None) -> Picture:
    """Return rows of images with headings, row names and notes below; None leaves a gap."""
    with canvas(1.25 * len(headings) + 0.6, 1.4 * len(rows) + 0.4, len(headings),
                len(rows)) as (figure, grid):
        for row, pictures in enumerate(rows):
            for column, picture in enumerate(pictures):
                axes = grid[row][column]
                axes.set_xticks([])
                axes.set_yticks([])
                for side in axes.spines.values():
                    side.set_visible(False)
                if picture is not None:
                    axes.imshow(picture)
                if row == 0:
                    axes.set_title(headings[column], fontsize=8)
                if column == 0:
                    axes.set_ylabel(names[row], fontsize=8)
                if notes is not None:
                    axes.set_xlabel(notes[row][column], fontsize=7)
        return drawn(figure)
