"""Steps of the extended or iterated filter on packed arrays, of one filter or of many; the formulas are kalman.py's."""

from dms_core.compiled.arena import floats, inner, table_at
from dms_core.compiled.jit import compiled
from dms_core.estimation.compiled.arrays import CODE, FILTER, TABLES
from dms_core.estimation.compiled.correction import correct
from dms_core.estimation.compiled.prediction import predict

FIELDS = len(TABLES)


@compiled
def filter_step(t, o):
    """Prediction over a period, and the correction at its end; gives a code."""
    code = predict(t, o)
    return code if code != CODE.done else correct(t, o)


@compiled(nogil=True, makes_arrays=True)
def step_some(addresses, o, readings, first, end, codes):
    """A step of filters `first` to `end` - 1 of many; `codes` takes the code of each.

    Args:
        addresses: of their packed `FilterTables`, shape (k,).
        o: options of the solver, the same for all.
        readings: of all filters' channels, NaN where there is none, shape (k, c).
        first: number of a filter.
        end: number behind the last one.
        codes: filled, shape (k,).
    """
    for i in range(first, end):
        t = table_at(addresses[i], FIELDS)
        reading = floats(inner(t, TABLES.filter), FILTER.reading)
        for c in range(reading.shape[0]):
            reading[c] = readings[i, c]
        codes[i] = filter_step(t, o)
