//! What a capture has come to. S2's letters A, B and C are pictures that are lost; these definitions are ours, by numbers, as if
//! the run ended now.

use super::frame::{ContactVector, cross, dot, sub};
use crate::layout::Items;

/// The first of these that fits, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CaptureOutcome {
    /// Jaws closed, the port's centre within the cage of the balls, slower than a hundredth of the first relative speed.
    Held = 1,
    /// Held, and the target turned by more than 5 degrees against the hand since the start.
    HeldTurned,
    /// Touches P1 and one jaw only.
    OneJaw,
    /// Jaws stopped by their limit of force before they were closed.
    Jammed,
    /// No contact in the last third of the time, and the distance grows.
    PushedAway,
    /// Nothing of that.
    Open,
}

/// The enumeration, in the order of [`CaptureOutcome`].
pub static OUTCOME: Items = Items {
    name: "Outcome",
    text: "What a capture has come to",
    items: &[
        ("held", "jaws closed, port within the cage of all balls, below 1 % of the first relative speed"),
        ("held-turned", "held, and the target turned by more than 5 degrees against the hand"),
        ("one-jaw", "touches P1 and one jaw only"),
        ("jammed", "jaws stopped by holdForceLimit before they were closed"),
        ("pushed-away", "no contact in the last third of the time, distance grows"),
        ("open", "time ran out"),
    ],
};

/// Share of the first relative speed below which a port is at rest in the hand.
const AT_REST: f64 = 0.01;
/// rad.
const TURNED: f64 = 5.0 * core::f64::consts::PI / 180.0;
/// Share of the time without contact after which a target is lost.
const LOST: f64 = 1.0 / 3.0;

/// What decides.
#[derive(Clone, Copy, Debug)]
pub(super) struct CaptureFacts {
    pub closed: bool,
    pub jammed: bool,
    pub caged: bool,
    /// Of the port against the hand, m/s; now and at the start.
    pub speed: [f64; 2],
    /// Of the target against the hand since the start, rad.
    pub turn: f64,
    pub touches_palm: bool,
    /// How many others touch.
    pub touching_jaws: usize,
    /// Time since the last contact and since the start, s.
    pub since: [f64; 2],
    pub parting: bool,
}

impl CaptureFacts {
    /// A pure function of these facts.
    pub(super) fn outcome(&self) -> CaptureOutcome {
        // (CON-10), in its order
        if self.closed && self.caged && self.speed[0] < AT_REST * self.speed[1] {
            return if self.turn.abs() > TURNED { CaptureOutcome::HeldTurned } else { CaptureOutcome::Held };
        }
        if self.touches_palm && self.touching_jaws == 1 {
            return CaptureOutcome::OneJaw;
        }
        if self.jammed {
            return CaptureOutcome::Jammed;
        }
        let touches = self.touches_palm || self.touching_jaws > 0;
        let lost = self.since[1] > 0.0 && self.since[0] > LOST * self.since[1];
        if !touches && lost && self.parting { CaptureOutcome::PushedAway } else { CaptureOutcome::Open }
    }
}

/// Whether a point is within the convex hull of others, boundary excluded: only there can forces of these balls on it, all
/// pushing, balance.
pub(super) fn caged(point: ContactVector<f64>, balls: &[ContactVector<f64>]) -> bool {
    // Within: from every ball another one is less than half a turn on.
    let to = |b: &ContactVector<f64>| sub(*b, point);
    balls.iter().all(|b| dot(to(b), to(b)) > 0.0 && balls.iter().any(|c| cross(to(b), to(c)) > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HELD: CaptureFacts = CaptureFacts {
        closed: true,
        jammed: false,
        caged: true,
        speed: [1e-5, 5e-3],
        turn: 0.01,
        touches_palm: true,
        touching_jaws: 2,
        since: [0.0, 30.0],
        parting: false,
    };

    /// Checks CON-10: every definition, and which one goes first.
    #[test]
    fn outcomes_are_as_defined() {
        let free = CaptureFacts { closed: false, touches_palm: false, touching_jaws: 0, ..HELD };
        for (facts, want) in [
            (HELD, CaptureOutcome::Held),
            (CaptureFacts { turn: -0.1, ..HELD }, CaptureOutcome::HeldTurned),
            (CaptureFacts { speed: [6e-5, 5e-3], ..HELD }, CaptureOutcome::Open),
            (CaptureFacts { caged: false, touching_jaws: 1, ..HELD }, CaptureOutcome::OneJaw),
            (CaptureFacts { caged: false, touching_jaws: 1, jammed: true, ..HELD }, CaptureOutcome::OneJaw),
            (CaptureFacts { jammed: true, ..free }, CaptureOutcome::Jammed),
            (
                CaptureFacts { jammed: true, since: [11.0, 30.0], parting: true, ..free },
                CaptureOutcome::Jammed,
            ),
            (CaptureFacts { since: [11.0, 30.0], parting: true, ..free }, CaptureOutcome::PushedAway),
            (
                CaptureFacts { since: [11.0, 30.0], parting: true, touching_jaws: 1, ..free },
                CaptureOutcome::Open,
            ),
            (CaptureFacts { since: [11.0, 30.0], ..free }, CaptureOutcome::Open),
        ] {
            assert_eq!(facts.outcome(), want, "{facts:?}");
        }
        assert_eq!(OUTCOME.items.len(), CaptureOutcome::Open as usize);
    }

    /// Checks CON-10 at its borders: a number at the border itself does not yet count.
    #[test]
    fn borders_belong_to_the_lesser_outcome() {
        let above = f64::next_up;
        let below = f64::next_down;
        let free =
            CaptureFacts { closed: false, touches_palm: false, touching_jaws: 0, parting: true, ..HELD };
        for (facts, want) in [
            (CaptureFacts { speed: [0.01, 1.0], ..HELD }, CaptureOutcome::Open),
            (CaptureFacts { speed: [below(0.01), 1.0], ..HELD }, CaptureOutcome::Held),
            (CaptureFacts { speed: [0.0, 0.0], ..HELD }, CaptureOutcome::Open),
            (CaptureFacts { turn: TURNED, ..HELD }, CaptureOutcome::Held),
            (CaptureFacts { turn: above(TURNED), ..HELD }, CaptureOutcome::HeldTurned),
            (CaptureFacts { turn: -above(TURNED), ..HELD }, CaptureOutcome::HeldTurned),
            (CaptureFacts { since: [10.0, 30.0], ..free }, CaptureOutcome::Open),
            (CaptureFacts { since: [above(10.0), 30.0], ..free }, CaptureOutcome::PushedAway),
            (CaptureFacts { since: [0.0, 0.0], ..free }, CaptureOutcome::Open),
        ] {
            assert_eq!(facts.outcome(), want, "{facts:?}");
        }
        assert!((TURNED.to_degrees() - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_cage_is_the_hull_of_the_balls() {
        let balls = [[0.0, 0.0], [0.15, 0.086], [0.15, -0.086]];
        assert!(caged([0.1, 0.01], &balls));
        assert!(!caged([0.16, 0.0], &balls) && !caged([0.1, 0.08], &balls) && !caged([-0.01, 0.0], &balls));
        assert!(!caged([0.1, 0.0], &balls[..2]));
    }
}
