//! The start: no part may lie inside another before the first step. Contact keeps parts from entering each other, but
//! could only throw out what is inside already, with an energy that the scene never had.

use glam::{DQuat, DVec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

use crate::diagnostics::{Diagnostic, Span};
use crate::geometry::Solid;
use crate::geometry::segments::closest_on_segments;
use crate::geometry::solid::segment_contact;
use crate::plan::{BodyRecipe, ContactRule, ContactSide, DomainId, Recipe};
use crate::scene::{Given, How, Item, ItemBody};

use super::{Maker, Unfolded};

/// Overlaps up to this share of a yarn's radius are touches: parts laid against each other, and rounding.
const TOUCH: f64 = 0.02;
/// The same for a ply tiled from a relaxed cell, whose yarns the plan knows as they were woven only.
const TOUCH_TILED: f64 = 0.5;
/// Ways out are rounded up to this, m.
const GRAIN: f64 = 1e-5;
/// The most stops on a way out before it is given up as too long.
const STOPS: usize = 200;

/// A segment of a yarn as woven: a round tube.
#[derive(Clone, Copy)]
struct Tube {
    ends: [DVec3; 2],
    radius: f64,
}

impl Tube {
    fn moved(self, by: DVec3) -> Self {
        Self { ends: self.ends.map(|end| end + by), ..self }
    }

    fn bounds(&self) -> Aabb {
        let [a, b] = self.ends;
        Aabb::new(a.min(b) - self.radius, a.max(b) + self.radius)
    }

    /// m; negative where the tubes overlap.
    fn gap(&self, other: &Tube) -> f64 {
        let [[a, b], [c, d]] = [self.ends, other.ends];
        closest_on_segments(a, b, c, d).delta.length() - self.radius - other.radius
    }
}

/// A body where it starts.
struct Placed {
    solid: Solid,
    centre: DVec3,
    back: DQuat,
}

impl Placed {
    /// `boxed`: contact takes the body as its bounding box.
    fn new(recipe: &BodyRecipe, boxed: bool) -> Self {
        let (position, turn) = (DVec3::from_array(recipe.position), DQuat::from_array(recipe.turn));
        let (middle, half) = recipe.solid.bounding_box();
        let (solid, middle) = if boxed { (Solid::Box { half }, middle) } else { (recipe.solid.clone(), DVec3::ZERO) };
        Self { solid, centre: position + turn * middle, back: turn.inverse() }
    }

    /// m; negative where the tube is in the body moved by `by`.
    fn gap(&self, tube: &Tube, by: DVec3) -> f64 {
        let [a, b] = tube.ends.map(|end| self.back * (end - self.centre - by));
        segment_contact(a, b, &self.solid).distance - tube.radius
    }

    fn may_meet(&self, tube: &Tube, by: DVec3) -> bool {
        let reach = self.solid.bounding_radius() + tube.radius + 0.5 * (tube.ends[1] - tube.ends[0]).length();
        (0.5 * (tube.ends[0] + tube.ends[1]) - self.centre - by).length_squared() < reach * reach
    }
}

/// How deep two parts overlap, and how far the second must go along which axis to be clear of the first (m).
struct Overlap {
    depth: f64,
    way: Option<(DVec3, f64)>,
}

impl Maker<'_> {
    /// Refuses every pair that may touch and starts inside each other.
    pub(super) fn refuse_overlapping_starts(&mut self, rules: &[ContactRule]) {
        for rule in rules {
            let found = match rule.between {
                [ContactSide::Chains(a), ContactSide::Chains(b)] if a != b => self.yarns_in_yarns(a, b),
                [ContactSide::Chains(a), ContactSide::Body(b)] => self.body_in_yarns(a, b, rule.boxed),
                _ => None,
            };
            if let Some(overlap) = found {
                self.refuse_start(rule.between, &overlap);
            }
        }
    }

    fn body_in_yarns(&self, chains: DomainId, body: u32, boxed: bool) -> Option<Overlap> {
        let recipes = self.body.domains.iter().find_map(|domain| match &domain.recipe {
            Recipe::Bodies(recipes) => Some(recipes),
            _ => None,
        })?;
        let placed = Placed::new(recipes.get(body as usize)?, boxed);
        let tubes = self.tubes(chains);
        let body = &placed;
        let near = |by: DVec3| tubes.iter().filter(move |tube| body.may_meet(tube, by));
        let over = self.touch(chains);
        let deepest = near(DVec3::ZERO).map(|tube| (placed.gap(tube, DVec3::ZERO), tube.radius));
        let depth = deepest.filter(|(gap, radius)| *gap < -over * radius).map(|(gap, _)| -gap).reduce(f64::max)?;
        let way = way_out(|along, from| {
            let inside = near(along * from).filter(|tube| placed.gap(tube, along * from) < 0.0);
            inside.map(|tube| exit(|s| placed.gap(tube, along * s), from, tube.radius)).reduce(f64::max)
        });
        Some(Overlap { depth, way })
    }

    fn yarns_in_yarns(&self, first: DomainId, second: DomainId) -> Option<Overlap> {
        let (a, b) = (self.tubes(first), self.tubes(second));
        let boxes: Vec<Aabb> = a.iter().map(Tube::bounds).collect();
        let whole =
            boxes.iter().copied().reduce(|all, one| Aabb::new(all.mins.min(one.mins), all.maxs.max(one.maxs)))?;
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        // Pairs of a tube of the first and a moved tube of the second that overlap.
        let deepest = |by: DVec3, share: f64, worst: &dyn Fn(&Tube, &Tube) -> f64| {
            let mut most: Option<f64> = None;
            for other in &b {
                let moved = other.moved(by);
                let bounds = moved.bounds();
                if bounds.mins.cmpgt(whole.maxs).any() || bounds.maxs.cmplt(whole.mins).any() {
                    continue;
                }
                for at in tree.intersect_aabb(&bounds) {
                    let tube = &a[at as usize];
                    if tube.gap(&moved) < -share * tube.radius.min(moved.radius) {
                        let here = worst(tube, other);
                        most = Some(most.map_or(here, |most| most.max(here)));
                    }
                }
            }
            most
        };
        let over = self.touch(first).max(self.touch(second));
        let depth = deepest(DVec3::ZERO, over, &|tube, other| -tube.gap(other))?;
        let way = way_out(|along, from| {
            deepest(along * from, 0.0, &|tube, other| exit(|s| tube.gap(&other.moved(along * s)), from, tube.radius))
        });
        Some(Overlap { depth, way })
    }

    fn touch(&self, chains: DomainId) -> f64 {
        match self.body.domains[chains.0 as usize].recipe {
            Recipe::Tiled { .. } => TOUCH_TILED,
            _ => TOUCH,
        }
    }

    fn tubes(&self, chains: DomainId) -> Vec<Tube> {
        let Some(unfolded) = self.unfolded.iter().find(|unfolded| unfolded.domain == chains) else {
            return Vec::new();
        };
        let Unfolded { yarns, laws, positions, .. } = unfolded;
        let segments = yarns.iter().flat_map(|yarn| {
            let law = &laws[yarn.law as usize];
            let radius = law.half_thickness.min(law.half_width);
            positions[yarn.nodes.start as usize..yarn.nodes.end as usize]
                .windows(2)
                .map(move |ends| Tube { ends: [ends[0], ends[1]], radius })
        });
        segments.collect()
    }

    /// The second of the pair is the one to move: a body, or the part that was written later.
    fn refuse_start(&mut self, between: [ContactSide; 2], overlap: &Overlap) {
        let scene = self.scene;
        let item = |side| self.item_of(side).map(|at| &scene.items[at]);
        let [Some(still), Some(moving)] = between.map(item) else { return };
        let position = position_of(moving);
        let is_body = matches!(moving.body, ItemBody::Body(_));
        let (code, what) = if is_body { ("E0726", "is in its yarns") } else { ("E0727", "yarns overlap") };
        let message = format!("`{}` starts inside `{}`", moving.name, still.name);
        let own = position.filter(|given| matches!(given.origin.how, How::Written | How::Set | How::Component));
        let place = own.map_or_else(|| self.headline(moving.span), Given::span);
        let mut found = Diagnostic::error(code, message, place, format!("{what} by {}", millimetres(overlap.depth)))
            .also(self.headline(still.span), format!("`{}` lies here", still.name));
        if let Some((along, distance)) = overlap.way {
            let distance = (distance / GRAIN * (1.0 - 1e-9)).ceil().max(1.0) * GRAIN;
            found = found.note(format!("Moved by {} along {} it is clear.", millimetres(distance), axis_name(along)));
            if let Some(given) = own
                && self.is_literal(given.span())
            {
                let [x, y, z] = (DVec3::from_array(given.value) + along * distance).to_array().map(tidy);
                let text = format!("[{x}, {y}, {z}] mm");
                found = found.fix(format!("write `position = {text}`"), given.span(), text);
            }
        }
        self.diagnostics.push(found);
    }

    /// Whether a span holds numbers in millimetres alone, so that other numbers may stand in their place.
    fn is_literal(&self, span: Span) -> bool {
        let numbers = |text: &str| text.chars().all(|c| "0123456789.,+-[] ".contains(c));
        self.sources.text(span).trim().strip_suffix("mm").is_some_and(numbers)
    }
}

fn position_of(item: &Item) -> Option<&Given<[f64; 3]>> {
    match &item.body {
        ItemBody::Body(body) => Some(&body.position),
        ItemBody::Weave(weave) => Some(&weave.position),
        _ => None,
    }
}

/// The nearest clear place along the six axes: direction and distance, m. `blocked(along, s)` says up to where at least
/// the way is barred for a part that has gone `s`.
fn way_out(blocked: impl Fn(DVec3, f64) -> Option<f64>) -> Option<(DVec3, f64)> {
    let mut best: Option<(DVec3, f64)> = None;
    // Upwards first: of equal ways the one against gravity is the one that people mean.
    for along in [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y] {
        let mut gone = 0.0;
        for _ in 0..STOPS {
            if best.is_some_and(|(_, least)| gone >= least) {
                break;
            }
            match blocked(along, gone) {
                Some(until) => gone = until.max(gone + 1e-3 * GRAIN),
                None => {
                    best = Some((along, gone));
                    break;
                }
            }
        }
    }
    best
}

/// The way at which a gap that is below zero at `from` has opened. A gap of convex pieces is convex along a straight
/// way, so it opens once.
fn exit(gap: impl Fn(f64) -> f64, from: f64, reach: f64) -> f64 {
    let (mut low, mut step) = (from, reach);
    while gap(low + step) < 0.0 && step < 1e6 * reach {
        (low, step) = (low + step, 2.0 * step);
    }
    let mut high = low + step;
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if gap(middle) < 0.0 { low = middle } else { high = middle }
    }
    high
}

fn axis_name(along: DVec3) -> String {
    let names = ["x", "y", "z"];
    let at = along.abs().max_position();
    format!("{}{}", if along[at] < 0.0 { "-" } else { "+" }, names[at])
}

fn millimetres(length: f64) -> String {
    let digits = if length < 0.995e-4 { 4 } else { 2 };
    format!("{:.digits$} mm", length * 1e3)
}

/// Metres to millimetres without the dust of rounding.
fn tidy(length: f64) -> f64 {
    (length * 1e7).round() / 1e4 + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_leaves_a_strand_by_the_shortest_axis() {
        let tube = Tube { ends: [DVec3::new(-5.0, 0.0, 0.0), DVec3::new(5.0, 0.0, 0.0)], radius: 0.5 };
        let recipe = Solid::Sphere { radius: 1.0 };
        let ball = Placed { solid: recipe, centre: DVec3::new(0.0, 0.3, 1.2), back: DQuat::IDENTITY };
        let way = way_out(|along, from| {
            let by = along * from;
            (ball.gap(&tube, by) < 0.0).then(|| exit(|s| ball.gap(&tube, along * s), from, tube.radius))
        });
        let (along, distance) = way.unwrap();
        assert_eq!(along, DVec3::Z);
        // The centres stand 1.5 apart once it is out: 1.2 + s = √(1.5² − 0.3²).
        assert!((distance - (1.5_f64.powi(2) - 0.09).sqrt() + 1.2).abs() < 1e-9);
    }

    #[test]
    fn a_way_through_a_row_of_yarns_goes_past_them_all() {
        let row =
            [0.0, 1.5, 3.0].map(|z| Tube { ends: [DVec3::new(-9.0, 0.0, z), DVec3::new(9.0, 0.0, z)], radius: 0.5 });
        let ball = Placed { solid: Solid::Sphere { radius: 1.0 }, centre: DVec3::ZERO, back: DQuat::IDENTITY };
        let blocked = |along: DVec3, from: f64| {
            let inside = row.iter().filter(|tube| ball.gap(tube, along * from) < 0.0);
            inside.map(|tube| exit(|s| ball.gap(tube, along * s), from, tube.radius)).reduce(f64::max)
        };
        let mut gone = 0.0;
        while let Some(until) = blocked(DVec3::Z, gone) {
            gone = until;
        }
        assert!((gone - 4.5).abs() < 1e-9, "{gone}");
        // Along the yarns the way is longer: past their ends.
        assert_eq!(blocked(DVec3::X, 10.4).map(|until| (until * 1e6).round()), Some(10.5e6));
    }
}
