//! Contact rules as a table over parts and bodies.

/// What a rule speaks about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClothSide {
    /// A part of the features, by its place in their list.
    Part(u32),
    /// A rigid body, by its place in the bodies.
    Body(u32),
}

/// How two sides touch. Pairs that no rule names never do; of several rules for a pair the first holds. A rule of a side
/// with itself is its self-contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClothRule {
    pub between: [ClothSide; 2],
    /// Share of the closing speed that comes back, 0…1.
    pub restitution: f64,
    /// Coulomb coefficients at rest and while sliding.
    pub at_rest: f64,
    pub sliding: f64,
}

/// The rule of every pair of sides.
#[derive(Clone, Debug, Default)]
pub(super) struct Laws {
    pub rules: Vec<ClothRule>,
    /// Some rule has a restitution.
    pub rebound: bool,
    parts: usize,
    sides: usize,
    table: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Laws {
    pub fn new(rules: &[ClothRule], parts: usize, bodies: usize) -> Self {
        let sides = parts + bodies;
        let mut table = vec![NONE; sides * sides];
        let place = |side: ClothSide| match side {
            ClothSide::Part(p) => ((p as usize) < parts).then_some(p as usize),
            ClothSide::Body(b) => ((b as usize) < bodies).then_some(parts + b as usize),
        };
        for (r, rule) in rules.iter().enumerate() {
            let [Some(a), Some(b)] = rule.between.map(place) else { continue };
            for at in [a * sides + b, b * sides + a] {
                if table[at] == NONE {
                    table[at] = r as u32;
                }
            }
        }
        let rebound = rules.iter().any(|rule| rule.restitution > 0.0);
        Self { rules: rules.to_vec(), rebound, parts, sides, table }
    }

    fn at(&self, a: usize, b: usize) -> Option<u32> {
        let rule = self.table[a * self.sides + b];
        (rule != NONE).then_some(rule)
    }

    pub fn of_parts(&self, a: u32, b: u32) -> Option<u32> {
        self.at(a as usize, b as usize)
    }

    pub fn of_body(&self, part: u32, body: u32) -> Option<u32> {
        self.at(part as usize, self.parts + body as usize)
    }

    pub fn of_bodies(&self, a: u32, b: u32) -> Option<u32> {
        self.at(self.parts + a as usize, self.parts + b as usize)
    }
}
