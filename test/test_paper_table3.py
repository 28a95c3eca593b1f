from active_recon.paper.measured import Measured
from active_recon.paper.table3 import real_table
import numpy as np

CATEGORIES = np.array(['car', 'lamp'])


def measured(iou):
    values = np.full((2, 3, 5), iou)
    return Measured(values, values, values, CATEGORIES)


def test_a_system_has_no_figure_where_the_truth_is_coarser_than_what_it_predicts():
    found = {'real_val': {'fine': measured(0.3), 'coarse': measured(0.5)},
             'real_cc0': {'coarse': measured(0.6)}}
    plain = {name: {'nearest': np.full((2, 3), 0.4)} for name in found}
    table = real_table(found, plain, list(found))
    cells = {column.heading: [cell and round(cell.mean, 6) for cell in column.cells]
             for column in table.columns}
    assert cells == {'fine': [0.3, 0.3, None, None], 'coarse': [0.5, 0.5, 0.6, 0.6],
                     'nearest': [0.4] * 4}
