//! Links that bend in a design: beams and tables of modes, and the same robot with links that do not.

use super::design::{DesignError, RobotDesign};
use super::spatial::Rigid;
use super::table::LinkTable;

impl RobotDesign {
    /// Whether links that bend can be, one per body.
    pub(super) fn check_links(&self) -> Result<(), DesignError> {
        let beams = self.flexures.iter().map(|f| (f.body, f.check()));
        let tables =
            self.link_tables.iter().map(|t| (t.body, t.check().map_err(|why| format!("its link: {why}"))));
        let mut seen = Vec::new();
        for (number, checked) in beams.chain(tables) {
            let fault = |body: &str, message: String| Err(DesignError { body: body.into(), message });
            let Some(body) = number.checked_sub(1).and_then(|b| self.links.get(b)) else {
                let message =
                    format!("a link that bends is that of body {number}; there are {}", self.links.len());
                return fault(&self.name, message);
            };
            if seen.contains(&number) {
                return fault(&body.name, "it has two links that bend; leave one of them out".into());
            }
            seen.push(number);
            checked.or_else(|why| fault(&body.name, why))?;
        }
        Ok(())
    }

    /// Whether bending shortens its links: as is chosen, else where its base is held, so that it has weight, links bend, and all that
    /// bend are beams, for a table does not give its shortening by bending.
    pub fn stiffens(&self) -> bool {
        let beams = !self.flexures.is_empty() && self.link_tables.is_empty();
        self.axial_stiffening.unwrap_or(self.held && beams)
    }

    /// That its weight does not stiffen or soften its links, though that was not chosen: tables keep it from being simulated.
    pub fn unstiffened(&self) -> Option<String> {
        let wanted = self.axial_stiffening.is_none() && self.held;
        let named = |t: &LinkTable| format!("`{}`", t.table.name);
        let tables: Vec<_> = self.link_tables.iter().filter(|_| wanted).map(named).collect();
        (!tables.is_empty()).then(|| {
            format!(
                "axial stiffening is off, of beams too: the link of {} is a table of modes, which does not give its shortening by bending; `axial-stiffening = false` in the file chooses that, and beams have it",
                tables.join(", of ")
            )
        })
    }

    /// The same with links that do not bend: their mass is their bodies'.
    #[must_use]
    pub fn stiffened(mut self) -> Self {
        let beams = std::mem::take(&mut self.flexures).into_iter().map(|f| (f.body, f.rigid()));
        let tables = std::mem::take(&mut self.link_tables).into_iter();
        let tables = tables.map(|t| (t.body, t.table.rigid().outwards(&t.table.frame())));
        for (body, link) in beams.chain(tables) {
            let Some(body) = body.checked_sub(1).and_then(|b| self.links.get_mut(b)) else { continue };
            let whole = Rigid::new(body.mass, body.center_of_mass, &body.inertia).plus(&link);
            let center = whole.first.map(|h| h / whole.mass);
            // About the centre: that of a body of no inertia there is taken away.
            let point = Rigid::new(whole.mass, center, &[[0.0; 3]; 3]);
            body.inertia = [0, 1, 2].map(|i| [0, 1, 2].map(|j| whole.inertia[i][j] - point.inertia[i][j]));
            (body.mass, body.center_of_mass) = (whole.mass, center);
        }
        self
    }
}
