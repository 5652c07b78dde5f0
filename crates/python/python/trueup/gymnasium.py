"""FMUs as environments of Gymnasium (the extra `gymnasium`).

    import trueup as tu
    from trueup.gymnasium import Environment

    env = Environment(tu.Model("TwoMassJoint"), actions={"motorCurrent": (-0.05, 0.05)},
                      observations=["motorAngle", "loadAngle"], reward=lambda values: -values["loadAngle"] ** 2)
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from ._errors import Error
from ._instance import Instance
from ._system import Fmu, Value

Floats = npt.NDArray[np.float64]
#: The observed variables by name, those of actions among them.
Values = Mapping[str, float | Floats]


class Environment(gymnasium.Env[Floats, Floats]):
    """An FMU in Co-Simulation. Actions are inputs and hold over a step; observations are variables, arrays one element after the
    other.

    Parameters:
        fmu: a `Model` or any `Fmu`.
        actions: inputs with their smallest and largest values, one for all elements of an array or one each.
        observations: names of variables.
        reward: of the values after a step.
        step: its length in s (0.01: 100 Hz).
        seconds: length of an episode; then it is truncated.
        terminated: whether the values end an episode.
        parameters: start values, the same in every episode.
        randomize: called with NumPy's generator (of the `seed`) at each reset; start values of that episode.
    """

    metadata: dict[str, Any] = {"render_modes": []}

    def __init__(
        self,
        fmu: Fmu,
        *,
        actions: Mapping[str, tuple[npt.ArrayLike, npt.ArrayLike]],
        observations: Sequence[str],
        reward: Callable[[Values], float],
        step: float = 0.01,
        seconds: float = 10.0,
        terminated: Callable[[Values], bool] | None = None,
        parameters: Mapping[str, Value] | None = None,
        randomize: Callable[[np.random.Generator], Mapping[str, Value]] | None = None,
    ) -> None:
        self._fmu, self._reward, self._terminated, self._randomize = fmu, reward, terminated, randomize
        self._step, self._steps = float(step), max(1, round(seconds / step))
        self._parameters = dict(parameters or {})
        self._instance: Instance | None = None
        self._count = 0
        self._actions = list(actions)
        self._sizes = [self._size(name, "input") for name in self._actions]
        bounds = zip(self._sizes, actions.values())
        ends = [[np.broadcast_to(np.asarray(end, float).ravel(), n) for end in pair] for n, pair in bounds]
        low, high = (np.concatenate([pair[k] for pair in ends]) for k in (0, 1))
        self.action_space = gymnasium.spaces.Box(low, high, dtype=np.float64)
        self._observations = list(observations)
        n = sum(self._size(name, None) for name in self._observations)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (n,), dtype=np.float64)

    def _size(self, name: str, causality: str | None) -> int:
        found = self._fmu.variables.get(name.partition("[")[0]) or self._fmu.variables.get(name)
        if found is None or (causality and found.causality != causality):
            what = f"{causality or 'variable'} `{name}`"
            mend = "`fmu.variables` lists them"
            raise Error(f"{self._fmu.model} has no {what}; {mend}", variable=name, mend=mend)
        return 1 if found.name != name else int(np.prod(found.shape, dtype=int))

    def _values(self) -> dict[str, float | Floats]:
        assert self._instance is not None
        return {name: self._instance.get(name) for name in dict.fromkeys([*self._observations, *self._actions])}

    def _observed(self, values: Values) -> Floats:
        return np.concatenate([np.ravel(values[name]) for name in self._observations]).astype(np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begins an episode; `options` are start values that go before all others."""
        super().reset(seed=seed)
        self.close()
        drawn = self._randomize(self.np_random) if self._randomize else {}
        self._instance = self._fmu.instance({**self._parameters, **drawn, **(options or {})})
        self._count = 0
        values = self._values()
        return self._observed(values), {"time": self._instance.time, "values": values}

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """One step with these inputs."""
        if self._instance is None:
            mend = "call reset() first"
            raise Error(f"no episode has begun; {mend}", mend=mend)
        flat = np.asarray(action, dtype=np.float64).ravel()
        wanted = sum(self._sizes)
        if flat.size != wanted:
            mend = f"give {wanted} values"
            raise Error(f"an action has {flat.size} values; {mend}", mend=mend)
        at = 0
        for name, size in zip(self._actions, self._sizes):
            self._instance.set(name, flat[at : at + size])
            at += size
        self._instance.step(self._step)
        self._count += 1
        values = self._values()
        ended = bool(self._terminated(values)) if self._terminated else False
        info = {"time": self._instance.time, "values": values}
        return self._observed(values), float(self._reward(values)), ended, self._count >= self._steps, info

    def close(self) -> None:
        """Ends the episode."""
        if self._instance is not None:
            self._instance.close()
            self._instance = None


__all__ = ["Environment"]
