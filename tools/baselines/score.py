"""Figures of several methods on the same cases, as crates/trials/src/score.rs defines them."""

import statistics

ABSENT = "–"


def _share(hits):
    hits = list(hits)
    return f"{100 * sum(hits) / len(hits):.0f} % ({sum(hits)}/{len(hits)})" if hits else ABSENT


def _lines(cases, names, pairs, classes):
    """(what, figure) of one method; `cases` are (key, answer), the flags say what the method can do at all."""
    of = lambda split: [(k, a) for k, a in cases if k.split == split]
    clear = [(k, a) for k, a in of("single") if k.ratio >= 3.0]
    library = clear + [(k, a) for k, a in of("pairs") if k.ratio >= 3.0]
    seen = lambda a: a.verdict in ("effects", "ambiguous", "unknown")
    claims = lambda a, e: a.verdict in ("effects", "ambiguous") and any(e in a.alike(c) for c in a.effects)
    told = [a.verdict == "parameters" for _, a in of("parameters")] + [seen(a) for _, a in clear]
    closed = [a.closed for _, a in clear if a.closed is not None]
    first = lambda k, a: a.first() is not None and k.effects[0] in a.alike(a.first())
    return [
        ("effect named first, by its exact id", names and _share(a.first() == k.effects[0] for k, a in clear)),
        ("- by class of at most 3", classes and _share(first(k, a) for k, a in clear)),
        ("among the first three candidates", names and _share(k.effects[0] in a.ranked[:3] for k, a in clear)),
        ("gap detected", _share(seen(a) for _, a in clear)),
        ("false alarm where there is no gap", _share(a.verdict != "no-gap" for _, a in of("none"))),
        ("parameters against effects", _share(told)),
        ("two effects: both found", pairs and _share(all(claims(a, e) for e in k.effects) for k, a in of("pairs"))),
        ("outside the library: unknown", _share(a.verdict == "unknown" for _, a in of("outside"))),
        ("inside the library, but called unknown", _share(a.verdict == "unknown" for _, a in library)),
        ("median share of the gap that is closed, single effects", closed and f"{statistics.median(closed):.2f}"),
    ]


# What each method can report: a name for an effect, two effects at once, sets that cannot be distinguished.
METHODS = {
    "Trueup": (True, True, True),
    "refit of parameters": (False, False, False),
    "STLSQ": (True, True, False),
    "random forest": (True, False, False),
}


def table(plant, keys, answers):
    """Markdown. `answers` holds per method a list as long as `keys`, None where the method did not see the case."""
    columns = {}
    for method, can in METHODS.items():
        if answers.get(method):
            columns[method] = _lines([(k, a) for k, a in zip(keys, answers[method]) if a], *can)
    counts = ", ".join(f"{sum(k.split == s for k in keys)} {s}" for s in dict.fromkeys(k.split for k in keys))
    text = [f"## {plant}", "", f"{len(keys)} cases: {counts}.", ""]
    text += [f"| figure | {' | '.join(columns)} |", "|---" * (len(columns) + 1) + "|"]
    for rows in zip(*columns.values()):
        text.append(f"| {rows[0][0]} | {' | '.join(figure or ABSENT for _, figure in rows)} |")
    return "\n".join(text) + "\n"
