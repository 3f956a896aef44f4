//! Contact rules put as tables: what holds between two kinds of yarn, or a kind of yarn and a body.

use crate::physics::{Bodies, Chains};
use crate::plan::{CompactionLaw, ContactRule, ContactSide, ContactVariant, DomainId, FrictionLaw, YarnLaw};

/// What two touching things do to each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PairLaw {
    /// Index of the rule that says so.
    pub rule: u32,
    pub restitution: f64,
    /// Coulomb coefficients; zero without friction.
    pub at_rest: f64,
    pub sliding: f64,
    pub variant: ContactVariant,
    pub boxed: bool,
}

/// Yarns of one domain and one law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Family {
    pub domain: DomainId,
    pub law: u32,
    /// As woven: b₀ and a₀·b₀ (m, m²).
    pub half_thickness: f64,
    pub axes_product: f64,
    /// The section is a circle that never flattens.
    pub round: bool,
    pub flattening: Option<Flattening>,
    /// kg/m.
    pub linear_density: f64,
    /// Time in which a section that nothing presses comes to rest, s.
    pub damping: f64,
}

/// Filaments side by side pass a shock on more slowly than along themselves, by the root of the ratio of their moduli:
/// √(82.6 GPa / 1.34 GPa) for KM2. A section comes to rest in the time in which that crosses its half-thickness.
const SLOWER_ACROSS: f64 = 8.0;

/// Least half-thickness (m), the limit and the pressure (Pa) of the compaction law; pressure zero for the free one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Flattening {
    pub least: f64,
    pub limit: f64,
    pub pressure: f64,
}

impl Family {
    fn new(domain: DomainId, law: u32, yarn: &YarnLaw) -> Self {
        let flattening = yarn.flattening.filter(|f| f.limit > 0.0).map(|f| Flattening {
            // A limit of one would leave a ribbon without end; a thousandth of the thickness is kept.
            least: (1.0 - f.limit.min(0.999)) * yarn.half_thickness,
            limit: f.limit.min(0.999),
            pressure: match f.law {
                CompactionLaw::Free => 0.0,
                CompactionLaw::Hardening { pressure } => pressure,
            },
        });
        Self {
            domain,
            law,
            half_thickness: yarn.half_thickness,
            axes_product: yarn.half_thickness * yarn.half_width,
            round: flattening.is_none() && yarn.half_thickness == yarn.half_width,
            flattening,
            linear_density: yarn.linear_density,
            damping: SLOWER_ACROSS * yarn.half_thickness * (yarn.linear_density / yarn.axial_stiffness).sqrt(),
        }
    }

    /// Half-width at half-thickness `b`, m: constant area (Barauskas & Kuprys §5.2).
    #[inline]
    pub fn half_width(&self, b: f64) -> f64 {
        self.axes_product / b
    }
}

/// All families and their pair laws.
#[derive(Clone, Debug, Default)]
pub(super) struct Laws {
    pub families: Vec<Family>,
    /// Family of each yarn.
    pub of_yarn: Vec<u16>,
    /// families × families.
    yarns: Vec<Option<PairLaw>>,
    /// bodies × families.
    bodies: Vec<Option<PairLaw>>,
    /// Corners of the boxes of the paper's variant reach farther than the section's half-axes by this factor.
    pub corner: f64,
}

impl Laws {
    pub fn new(rules: &[ContactRule], chains: &Chains, bodies: &Bodies) -> Self {
        let mut laws = Self::default();
        for yarn in &chains.yarns {
            let known = laws.families.iter().position(|f| f.domain == yarn.domain && f.law == yarn.law);
            let family = known.unwrap_or_else(|| {
                laws.families.push(Family::new(yarn.domain, yarn.law, &chains.laws[yarn.law as usize]));
                laws.families.len() - 1
            });
            laws.of_yarn.push(family as u16);
        }
        let boxes = rules.iter().any(|r| r.variant == ContactVariant::Boxes);
        laws.corner = if boxes { std::f64::consts::SQRT_2 } else { 1.0 };
        let friction = |f: &Family| chains.laws[f.law as usize].friction;
        for a in &laws.families {
            for b in &laws.families {
                let sides = [ContactSide::Chains(a.domain), ContactSide::Chains(b.domain)];
                laws.yarns.push(pair_law(rules, sides, mean(friction(a), friction(b))));
            }
        }
        for body in 0..bodies.position.len() as u32 {
            for a in &laws.families {
                let sides = [ContactSide::Chains(a.domain), ContactSide::Body(body)];
                laws.bodies.push(pair_law(rules, sides, friction(a)));
            }
        }
        laws
    }

    #[inline]
    pub fn of_yarns(&self, a: u16, b: u16) -> Option<&PairLaw> {
        self.yarns[a as usize * self.families.len() + b as usize].as_ref()
    }

    #[inline]
    pub fn of_body(&self, body: u32, yarn: u16) -> Option<&PairLaw> {
        self.bodies[body as usize * self.families.len() + yarn as usize].as_ref()
    }

    pub fn any_between_yarns(&self) -> bool {
        self.yarns.iter().any(Option::is_some)
    }

    pub fn any_with(&self, body: u32) -> bool {
        let n = self.families.len();
        self.bodies[body as usize * n..][..n].iter().any(Option::is_some)
    }

    /// Both sections are circles that never flatten: no direction of theirs matters.
    #[inline]
    pub fn are_round(&self, families: [u16; 2]) -> bool {
        families.iter().all(|f| self.families[*f as usize].round)
    }

    pub fn flattens(&self) -> bool {
        self.families.iter().any(|f| f.flattening.is_some())
    }
}

/// The first rule that names both sides, in either order. Friction of the pair where the rule gives none: the geometric
/// mean of both yarns, or the yarn's own against a body.
fn pair_law(rules: &[ContactRule], sides: [ContactSide; 2], own: Option<FrictionLaw>) -> Option<PairLaw> {
    let [a, b] = sides;
    let (index, rule) = rules.iter().enumerate().find(|(_, r)| r.between == [a, b] || r.between == [b, a])?;
    let friction = rule.friction.or(own);
    Some(PairLaw {
        rule: index as u32,
        restitution: rule.restitution,
        at_rest: friction.map_or(0.0, |f| f.at_rest),
        sliding: friction.map_or(0.0, |f| f.sliding),
        variant: rule.variant,
        boxed: rule.boxed,
    })
}

fn mean(a: Option<FrictionLaw>, b: Option<FrictionLaw>) -> Option<FrictionLaw> {
    let (a, b) = (a?, b?);
    Some(FrictionLaw { at_rest: (a.at_rest * b.at_rest).sqrt(), sliding: (a.sliding * b.sliding).sqrt() })
}
