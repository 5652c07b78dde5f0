"""What the tests against engines share."""

import numpy as np


def report(what, errors, limit):
    """Prints quantiles of the errors (relative to the largest entry) and holds the largest to the limit."""
    quantiles = np.quantile(errors, [0.5, 0.9, 0.99, 1.0])
    print(f"{what}: 50 % {quantiles[0]:.1e}, 90 % {quantiles[1]:.1e}, 99 % {quantiles[2]:.1e}, largest {quantiles[3]:.1e}")
    assert quantiles[3] < limit
