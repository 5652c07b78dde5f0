//! What is fixed of a robot in space when a model is packed.

use super::ritz::MAX_LINK_SHAPES;
use super::shapes::{MAX_SHAPES, Shapes};
use super::tree::Tree;
use super::{MAX_APPENDAGES, MAX_BODIES, MAX_MODES_OF_ALL, MAX_MODES_OF_LINK, MAX_THRUSTERS, MAX_TIPS};

/// What is fixed when a model is packed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RobotStructure {
    /// Bodies and joints.
    pub tree: Tree,
    /// Per moving body: its joint has a spring between motor and body.
    pub flexible: Vec<bool>,
    /// Per end effector the body that it is fixed to (from 1).
    pub tips: Vec<usize>,
    /// Thrusters of the base.
    pub thrusters: usize,
    /// Per appendage of the base the numbers of its shapes.
    pub appendages: Vec<Shapes>,
    /// Per appendage that is a table of modes, behind those: their number.
    pub tables: Vec<usize>,
    /// Per moving body the numbers of shapes of its link, on whose end hangs what the body carries; empty: all links are rigid.
    pub links: Vec<Shapes>,
    /// Per moving body the number of modes of its link that is a table; 0: it is none; empty: there are none.
    pub tabled_links: Vec<usize>,
    /// Bending shortens links, so that loads along them stiffen or soften them.
    pub axial_stiffening: bool,
    /// The base does not move.
    pub held: bool,
    /// There are outputs of what a pose is worth.
    pub analysis: bool,
}

impl RobotStructure {
    /// Moving bodies.
    pub fn bodies(&self) -> usize {
        self.tree.bodies()
    }
    /// Flexible joints.
    pub fn springs(&self) -> usize {
        self.flexible.iter().filter(|f| **f).count()
    }
    fn most_shapes(&self) -> usize {
        self.appendages.iter().flat_map(|a| [a.x, a.y, a.torsion]).max().unwrap_or(0)
    }
    /// Appendages, beams and tables.
    pub fn panels(&self) -> usize {
        self.appendages.len() + self.tables.len()
    }
    /// Modes of tables.
    pub fn tabled(&self) -> usize {
        self.tables.iter().sum()
    }
    /// Modal coordinates.
    pub fn modes(&self) -> usize {
        self.appendages.iter().map(Shapes::modes).chain(self.tables.iter().copied()).sum::<usize>()
            + self.linked()
    }
    /// Bodies (from 1) whose link is a beam that bends, with its shapes.
    pub fn beams(&self) -> impl Iterator<Item = (usize, Shapes)> + '_ {
        self.links.iter().enumerate().filter(|(_, s)| s.modes() > 0).map(|(k, s)| (k + 1, *s))
    }
    /// Bodies (from 1) whose link is a table of modes, with their number.
    pub fn link_tables(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.tabled_links.iter().enumerate().filter(|(_, m)| **m > 0).map(|(k, m)| (k + 1, *m))
    }
    /// Bodies (from 1) whose link bends, with the number of its modes: beams, then tables.
    pub fn bending(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.beams().map(|(body, s)| (body, s.modes())).chain(self.link_tables())
    }
    /// Links that bend.
    pub fn links(&self) -> usize {
        self.bending().count()
    }
    /// Modal coordinates of links: the last ones.
    pub fn linked(&self) -> usize {
        self.bending().map(|b| b.1).sum()
    }
    /// Modes of links that are tables: the last of those.
    pub fn linked_tabled(&self) -> usize {
        self.tabled_links.iter().sum()
    }

    /// Whether there can be such a model.
    ///
    /// # Errors
    /// What cannot be, with the remedy.
    pub fn check(&self) -> Result<(), String> {
        let n = self.bodies();
        for (what, there, most) in [
            ("moving bodies", n, MAX_BODIES),
            ("tips", self.tips.len(), MAX_TIPS),
            ("thrusters", self.thrusters, MAX_THRUSTERS),
            ("appendages and links that bend", self.panels() + self.links(), MAX_APPENDAGES),
            ("modal coordinates", self.modes(), MAX_MODES_OF_ALL),
            ("shapes in a direction", self.most_shapes(), MAX_SHAPES),
        ] {
            if there > most {
                return Err(format!("{there} {what} cannot be had, at most {most}"));
            }
        }
        if self.tree.joint.len() != n || self.flexible.len() != n {
            return Err(format!(
                "{n} bodies have {} joint types and {} entries of jointFlexible; give one of each per body",
                self.tree.joint.len(),
                self.flexible.len()
            ));
        }
        if !self.links.is_empty() && self.links.len() != n {
            let rows = self.links.len();
            return Err(format!(
                "linkModes has {rows} rows for {n} bodies; give one per body, 0, 0, 0 for a rigid link"
            ));
        }
        self.check_link_tables()?;
        for (body, s) in self.beams() {
            let most = s.x.max(s.y).max(s.torsion);
            if most > MAX_LINK_SHAPES {
                return Err(format!(
                    "linkModes[{body}] requests {most} shapes in one direction, at most {MAX_LINK_SHAPES} are possible"
                ));
            }
            if s.x != s.y && s.x.min(s.y) > 0 {
                return Err(format!(
                    "linkModes[{body}] = {}, {}, {}: give the link the same number of shapes along x and along y, or 0 along one",
                    s.x, s.y, s.torsion
                ));
            }
        }
        if let Some(k) = (0..n).find(|k| self.tree.parent[*k] > *k) {
            return Err(format!(
                "parent[{}] = {}: a body comes after the one that carries it; number bodies from the base (0) outwards",
                k + 1,
                self.tree.parent[k]
            ));
        }
        match self.tips.iter().position(|t| *t == 0 || *t > n) {
            Some(a) if self.tips[a] == 0 => {
                let why = "it is fixed to the base, whose motion has outputs of its own";
                Err(format!("tip {}: {why}; fix it to a moving body, or leave it out", a + 1))
            }
            Some(a) => {
                Err(format!("tip[{}] = {}: the moving bodies are 1 to {n}; name one", a + 1, self.tips[a]))
            }
            None => Ok(()),
        }
    }

    fn check_link_tables(&self) -> Result<(), String> {
        let (n, rows) = (self.bodies(), self.tabled_links.len());
        if rows > 0 && rows != n {
            return Err(format!(
                "modesOfLinkTable has {rows} entries for {n} bodies; give one per body, 0 where its link is no table"
            ));
        }
        for (body, modes) in self.link_tables() {
            if modes > MAX_MODES_OF_LINK {
                return Err(format!(
                    "the link of body {body} has {modes} modes, at most {MAX_MODES_OF_LINK} can be had; leave out those of the highest frequencies"
                ));
            }
            if self.beams().any(|b| b.0 == body) {
                return Err(format!(
                    "the link of body {body} is a beam and a table of modes; give one of both"
                ));
            }
            if self.axial_stiffening {
                return Err(format!(
                    "axial stiffening needs beams, and the link of body {body} is a table of modes, which does not give the shortening by bending; leave axial-stiffening (axialStiffening) off, or give that link as a beam"
                ));
            }
        }
        Ok(())
    }
}
