//! Whether what a set does to the gap makes its causes known.

use super::Thresholds;

/// What a set does to the gap.
pub(super) struct Account {
    /// It has effects.
    pub claims: bool,
    /// Excess without them and with them, over what is left at the least.
    pub whole: f64,
    pub left: f64,
    /// Share of the free-running gap above the floor (as powers) that it closes.
    pub closed: f64,
    /// Its own free run shows it, and does not diverge far: it may be as sensitive as the plant itself.
    pub is_evidence: bool,
}

impl Account {
    /// It claims effects of which the balances see nothing: they do not vote.
    pub(super) fn is_blind(&self, limits: &Thresholds) -> bool {
        self.claims && self.whole.max(self.left) < limits.gap.left
    }
    /// Share of the excess that it explains, or of the free run's where the balances are blind.
    pub(super) fn explained(&self, limits: &Thresholds) -> f64 {
        if self.is_blind(limits) {
            return self.closed;
        }
        (1.0 - self.left / self.whole.max(1e-12)).clamp(0.0, 1.0)
    }
    /// Share of the gap that it accounts for: balances determine the law, free runs the size, and either may be spoilt by the
    /// form of a law.
    pub(super) fn known(&self, limits: &Thresholds) -> f64 {
        let balances = self.explained(limits);
        // What they see plainly and mostly do not explain is not known, however well a free run makes up for it.
        let plain = self.whole.max(self.left) > limits.gap.bare;
        if plain && self.left > limits.gap.left && balances < 0.5 {
            return balances;
        }
        let both = 0.5 * (balances + self.closed);
        let least = if plain { balances.min(self.closed) } else { self.closed };
        // What they see plainly and wholly explain is known, whatever becomes of a free run that bifurcates.
        let explained_alone =
            self.whole > limits.gap.bare && self.left < limits.gap.bare && balances > limits.gap.known;
        if self.is_evidence && least < limits.gap.neither && !explained_alone {
            return both;
        }
        balances.max(self.closed).max(both + 0.2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_balances_and_free_runs_give_together() {
        let limits = Thresholds::default();
        // Excess without and with the effects, share of the free run's gap closed, whether that is evidence; known enough?
        let cases = [
            ("both see it and it goes", 100.0, 0.1, 0.98, true, true),
            (
                "balances see it plainly and most of it stays, though the free run is corrected",
                100.0,
                60.0,
                0.95,
                true,
                false,
            ),
            ("balances see nothing: the free run alone", 0.2, 0.1, 0.9, true, true),
            ("balances see nothing, and the free run is corrected by half", 0.2, 0.1, 0.5, true, false),
            ("a little seen and left, but the free run is corrected", 1.5, 1.0, 0.95, true, true),
            ("balances explain most, the free run diverges", 100.0, 8.0, 0.0, true, false),
            ("the same, but nothing plain is left", 100.0, 1.0, 0.0, true, true),
            ("the same, but no free run is evidence", 100.0, 8.0, 0.0, false, true),
        ];
        for (what, whole, left, closed, is_evidence, expected) in cases {
            let account = Account { claims: true, whole, left, closed, is_evidence };
            let known = account.known(&limits);
            assert_eq!(known >= limits.gap.explained, expected, "{what}: {known}");
        }
    }
}
