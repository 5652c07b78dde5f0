"""The two-mass joint with stick-slip solved without a step-size error: between events the system is linear with
constant coefficients, so the matrix exponential carries it on; events are found by bisection of the exact solution.
Written from the equations of the paper (section 3.2), not from the project's code."""

import numpy as np
from scipy.linalg import expm


class ExactJoint:
    def __init__(self, J_m, J_l, n, K_t, K, D, tau_c, tau_s, D_m):
        self.n, self.K_t, self.tau_c, self.tau_s = n, K_t, tau_c, tau_s
        # x = [q_m, w_m, q_l, w_l, 1]; the last entry carries the constant torques
        self.slip = np.zeros((5, 5))
        self.slip[0, 1] = self.slip[2, 3] = 1.0
        self.slip[1, :4] = np.array([-K, -D - D_m, K * n, D * n]) / J_m
        self.slip[3, :4] = n * np.array([K, D, -K * n, -D * n]) / J_l
        self.stick = self.slip.copy()
        self.stick[0, :] = self.stick[1, :] = 0.0
        self.row = np.array([-K, -D, K * n, D * n, 0.0])
        self.J_m, self.J_l = J_m, J_l
        self.x = np.zeros(5)
        self.x[4] = 1.0
        self.t, self.mode, self.events = 0.0, 0, []
        self.tau_m = self.tau_ext = 0.0

    def applied(self, x):
        return self.tau_m + self.row @ x

    def matrix(self):
        A = (self.stick if self.mode == 0 else self.slip).copy()
        A[3, 4] += self.tau_ext / self.J_l
        if self.mode != 0:
            A[1, 4] += (self.tau_m - self.mode * self.tau_c) / self.J_m
        return A

    def margin(self, x):
        """Positive while the mode may go on."""
        if self.mode == 0:
            return self.tau_s - abs(self.applied(x))
        return self.mode * x[1]

    def set(self, current, tau_ext=0.0):
        self.tau_m, self.tau_ext = self.K_t * current, tau_ext
        self.settle()

    def settle(self):
        before = self.mode
        if self.mode == 0 and abs(self.applied(self.x)) > self.tau_s:
            self.mode = int(np.sign(self.applied(self.x)))
        if self.mode != before:
            self.events.append((self.t, self.mode))

    def advance(self, t_end, h=2e-4):
        """h is how far apart the exact solution is looked at for events; it carries no error of its own."""
        while self.t < t_end - 1e-15:
            step = min(h, t_end - self.t)
            A = self.matrix()
            ahead = expm(A * step) @ self.x
            started = self.mode != 0 and abs(self.x[1]) < 1e-12
            if self.margin(ahead) > 0 or (started and self.margin(ahead) == 0):
                self.x, self.t = ahead, self.t + step
                continue
            low, high = 0.0, step
            while high - low > 1e-15:
                middle = 0.5 * (low + high)
                x = expm(A * middle) @ self.x
                if self.margin(x) > 0 or (middle < 1e-9 and started):
                    low = middle
                else:
                    high = middle
                if middle in (low, high) and high - low < 1e-14:
                    break
            self.x, self.t = expm(A * high) @ self.x, self.t + high
            if self.mode == 0:
                self.mode = int(np.sign(self.applied(self.x)))
            else:
                self.x[1] = 0.0
                torque = self.applied(self.x)
                self.mode = 0 if abs(torque) <= self.tau_s else int(np.sign(torque))
            self.events.append((self.t, self.mode))
        return self.x
