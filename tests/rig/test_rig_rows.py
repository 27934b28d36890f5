"""What rows may say of one another: -1 names no row, and is no place from the end."""

from dataclasses import replace

import numpy as np
import pytest

from clbrdf.errors import InputError
from clbrdf.rig.budget import Budget
from clbrdf.rig.calibrate import calibrate
from clbrdf.rig.row import CHECK, DARK, KINDS, POINT, RUNG, SKIPPED
from tests.damaged.sources import raw


def changed(scan, **columns):
    """The rows with some values of some columns changed, as (row, value)."""
    rows = {name: values.copy() for name, values in scan.rows.items()}
    for name, pairs in columns.items():
        for row, value in pairs:
            rows[name][row] = value
    return replace(scan, rows=rows)


# Rows 0 to 4 are a dark, a direct beam, and three points.
@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"dark": [(3, -1)]}, "dark of row 3, of kind point, is -1; .* an earlier row of kind dark; "),
        ({"dark": [(1, -1)]}, "dark of row 1, of kind direct, is -1"),
        ({"dark": [(4, 1)]}, "dark of row 4, of kind point, is 1; .* of kind dark; "),
        ({"direct": [(2, -1)]}, "direct of row 2, of kind point, is -1; .* of kind direct or panel; "),
        ({"direct": [(2, 0)]}, "direct of row 2, of kind point, is 0"),
        ({"direct": [(2, 5)]}, "direct of row 2, of kind point, is 5"),
        ({"rung": [(3, 2)]}, "rung of row 3, of kind point, is 2; .* of kind rung, or -1 for none; "),
        # Rungs that name one another have no end.
        ({"kind": [(3, RUNG)], "rung": [(3, 3)]}, "rung of row 3, of kind rung, is 3; .* an earlier row"),
        ({"dark": [(3, -2)]}, "dark of row 3, of kind point, is -2"),
        ({"kind": [(4, 6)]}, "kind of row 4 is 6, and 0 to 5 is possible"),
        ({"scans": [(1, 0)]}, "scans of row 1 is 0, and 1 to"),
    ],
)
def test_rows_that_no_measurement_writes_are_refused(tmp_path, columns, message):
    with pytest.raises(InputError, match=message + ".*restore them from a copy$"):
        changed(raw(tmp_path), **columns)


def test_rows_that_need_no_other_row(tmp_path):
    whole = raw(tmp_path)
    assert [KINDS[k] for k in whole.rows["kind"]] == ["dark", "direct", "point", "point", "point"]
    skipped = changed(whole, flags=[(3, SKIPPED)], dark=[(3, -1)], direct=[(3, -1)], axes=[(3, np.nan)])
    changed(whole, dark=[(0, -1)], direct=[(0, -1), (1, -1)])
    changed(whole, kind=[(3, CHECK)], direct=[(3, -1)])
    assert np.count_nonzero(np.isin(skipped.rows["kind"], (POINT, DARK))) == 4


def test_a_skipped_point_is_not_measured_and_changes_no_other(tmp_path):
    """-1 of a skipped point takes nothing from the last row, which it would be as a place."""
    whole = raw(tmp_path)
    grid = whole.plan.model_copy(update={"wavelength": whole.plan.wavelength.model_copy(
        update={"start": 520.0, "stop": 580.0, "step": 20.0})})  # fmt: skip
    whole = replace(whole, plan=grid)
    skipped = changed(whole, flags=[(3, SKIPPED)], dark=[(3, -1)], direct=[(3, -1)], axes=[(3, np.nan)])
    all_there, one_less = calibrate(whole, Budget()), calibrate(skipped, Budget())
    assert np.isnan(one_less.brdf[1]).all()
    assert np.array_equal(one_less.brdf[[0, 2]], all_there.brdf[[0, 2]])
