"""A random forest on the features of generated cases whose truth is known."""

import numpy as np
from sklearn.ensemble import RandomForestClassifier

from cases import Answer

VERDICTS = {"none": "no-gap", "parameters": "parameters", "outside": "unknown"}


class Forest:
    """Of one plant."""

    def __init__(self, features, keys):
        label = lambda k: k.effects[0] if k.split == "single" else VERDICTS.get(k.split)
        taught = [(f, label(k)) for f, k in zip(features, keys) if f and label(k)]
        self.names = sorted({name for f, _ in taught for name in f})
        # Classes are as many as they are: of some effects there are few cases.
        self.forest = RandomForestClassifier(
            1000, max_features=0.2, min_samples_leaf=2, class_weight="balanced", oob_score=True, random_state=0
        )
        self.forest.fit([self._row(f) for f, _ in taught], [label for _, label in taught])

    def _row(self, features):
        """What a case does not have, such as a channel, is missing."""
        return [features.get(name, np.nan) for name in self.names]

    def answers(self, features):
        """One per case; a case without features has no answer but that something is there."""
        rows = [self._row(f) for f in features if f]
        shares = iter(self.forest.predict_proba(rows) if rows else [])
        return [self._answer(next(shares)) if f else Answer("unknown") for f in features]

    def _answer(self, shares):
        order = [str(self.forest.classes_[i]) for i in np.argsort(-shares)]
        effects = [label for label in order if label not in VERDICTS.values()]
        if order[0] in VERDICTS.values():
            return Answer(order[0], ranked=effects)
        return Answer("effects", order[:1], effects)
