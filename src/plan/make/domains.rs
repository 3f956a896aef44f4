//! Parts to domains: weaves and strands become chains.

use std::ops::Range;

use glam::{DQuat, DVec3};

use crate::diagnostics::Diagnostic;
use crate::geometry::WeaveRecipe;
use crate::geometry::draft::Draft;
use crate::geometry::section::Section;
use crate::geometry::weave::{self, WeaveError, WeavePaths};
use crate::plan::{Domain, DomainId, Recipe, Topology, YarnLaw};
use crate::scene::{Both, CellSource, Extent, Extents, Given, Item, ItemBody, ItemId, Pattern, Strand, Threads, Weave};

use super::Maker;

pub(in crate::plan) use crate::geometry::weave::Family;

/// Nodes in a block: two blocks of state fit a core's second-level cache with room for contact.
pub(super) const BLOCK: u32 = 4096;

/// More nodes than this are refused before memory is taken for them.
const MOST_NODES: usize = 60_000_000;

/// What an item became.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    Chains(DomainId),
    /// A sheet, a line, or a body that is a mass point.
    Net(DomainId),
    /// Index within the bodies domain.
    Body(u32),
}

/// The rest geometry of a chain domain.
pub(in crate::plan) struct Unfolded {
    pub domain: DomainId,
    pub yarns: Vec<UnfoldedYarn>,
    pub laws: Vec<YarnLaw>,
    pub positions: Vec<DVec3>,
    pub rest_length: Vec<f64>,
    /// Width of cloth for each yarn end, m.
    pub pitch: f64,
}

pub(in crate::plan) struct UnfoldedYarn {
    pub family: Family,
    pub thread: u32,
    pub nodes: Range<u32>,
    /// Index into [`Unfolded::laws`].
    pub law: u32,
}

impl Unfolded {
    /// `warp 12, yarn seed`
    pub fn yarn_name(&self, yarn: usize) -> String {
        let known = &self.yarns[yarn];
        let family = match known.family {
            Family::Warp => "warp",
            Family::Weft => "weft",
        };
        format!("{family} {}, yarn {}", known.thread, self.laws[known.law as usize].name)
    }
}

impl Recipe {
    /// The laws of a chain domain's yarns; none elsewhere.
    pub fn laws(&self) -> &[YarnLaw] {
        match self {
            Recipe::Weave { laws, .. } | Recipe::Tiled { laws, .. } => laws,
            Recipe::Strand { law, .. } => std::slice::from_ref(law),
            Recipe::Sheet { .. } | Recipe::Line { .. } | Recipe::Points(_) | Recipe::Bodies(_) => &[],
        }
    }
}

impl Maker<'_> {
    pub(super) fn plan_domains(&mut self) {
        self.domain_of = vec![None; self.scene.items.len()];
        let scene = self.scene;
        for (id, item) in scene.ids() {
            let made = match &item.body {
                ItemBody::Weave(weave) => self.weave(item, weave),
                ItemBody::Strand(strand) => self.strand(item, strand),
                _ => None,
            };
            if let Some((recipe, unfolded)) = made {
                self.add_chains(id, item, recipe, unfolded);
            }
        }
        self.plan_net();
        self.bodies();
        if self.body.domains.is_empty() && !self.diagnostics.iter().any(Diagnostic::is_error) {
            self.diagnostics.push(Diagnostic::placeless(
                "E0814",
                crate::diagnostics::Severity::Error,
                "there is nothing in the scene that could move",
            ));
        }
    }

    fn add_chains(&mut self, id: ItemId, item: &Item, recipe: Recipe, mut unfolded: Unfolded) {
        let origin = self.written(item.span);
        let domain = DomainId(self.body.domains.len() as u32);
        unfolded.domain = domain;
        let breaks = unfolded.laws.iter().any(|law| law.breaks.is_some());
        self.body.domains.push(Domain {
            name: item.name.clone(),
            recipe,
            topology: if breaks { Topology::Breaks } else { Topology::Fixed },
            block: BLOCK,
            nodes: unfolded.positions.len() as u32,
            pieces: unfolded.yarns.len() as u32,
            origin,
        });
        self.unfolded.push(unfolded);
        self.domain_of[id.0 as usize] = Some(Place::Chains(domain));
    }

    fn weave(&mut self, item: &Item, weave: &Weave) -> Option<(Recipe, Unfolded)> {
        match &weave.pattern {
            Pattern::Draft(draft) => {
                let woven = self.woven(item, weave, draft)?;
                let velocity = self.velocity(item, &weave.velocity);
                let Woven { recipe, paths, laws, warp, weft } = woven;
                let unfolded = unfold(&recipe, &paths, &laws, &warp, &weft);
                Some((Recipe::Weave { paths: recipe, laws, warp, weft, velocity }, unfolded))
            }
            Pattern::Cell(source) => self.tiled(item, weave, source),
        }
    }

    /// A ply woven from a draft.
    fn woven(&mut self, item: &Item, weave: &Weave, draft: &Given<crate::scene::Draft>) -> Option<Woven> {
        self.take(format!("{}.pattern", item.name), draft, &draft.name);
        let (Some(warp), Some(weft), Some(sett)) = (&weave.warp, &weave.weft, &weave.sett) else {
            let found =
                Diagnostic::error("E0701", format!("`{}` needs `warp`, `weft` and `sett`", item.name), item.span, "")
                    .note("Only a ply tiled from a relaxed `cell` takes its yarns from there.");
            self.diagnostics.push(found);
            return None;
        };
        for (family, sett) in [("warp", &sett.warp), ("weft", &sett.weft)] {
            self.take(format!("{}.sett.{family}", item.name), sett, format!("{} /cm", **sett / 100.0));
        }
        let (ends, picks) = self.threads(item, weave, draft, sett)?;
        self.take(
            format!("{}.nodes_per_crossing", item.name),
            &weave.nodes_per_crossing,
            weave.nodes_per_crossing.to_string(),
        );
        self.take(format!("{}.shares", item.name), &weave.shares, format!("{} %", *weave.shares * 100.0));
        if !(0.0..=1.0).contains(&*weave.shares) {
            let found = Diagnostic::error(
                "E0702",
                "the warp's share of the crimp lies between 0 and 1",
                weave.shares.span(),
                "outside 0 % .. 100 %",
            );
            self.diagnostics.push(found);
            return None;
        }
        let (mut laws, mut warp_of) = (Vec::new(), Vec::new());
        self.thread_laws(warp, ends, &mut laws, &mut warp_of);
        let mut weft_of = Vec::new();
        self.thread_laws(weft, picks, &mut laws, &mut weft_of);
        let section = |law: &u32| {
            let law: &YarnLaw = &laws[*law as usize];
            Section { half_thickness: law.half_thickness, half_width: law.half_width }
        };
        let [x, y, z, w] = *weave.turn;
        let recipe = WeaveRecipe {
            draft: Draft {
                ends: draft.ends as usize,
                picks: draft.picks as usize,
                up: draft.up.clone(),
                end_colours: draft.end_colours.iter().map(|colour| *colour as u16).collect(),
                pick_colours: draft.pick_colours.iter().map(|colour| *colour as u16).collect(),
            },
            ends,
            picks,
            end_spacing: 1.0 / *sett.warp,
            pick_spacing: 1.0 / *sett.weft,
            end_sections: warp_of.iter().map(section).collect(),
            pick_sections: weft_of.iter().map(section).collect(),
            nodes_per_crossing: *weave.nodes_per_crossing,
            warp_share: *weave.shares,
            origin: DVec3::from_array(*weave.position),
            turn: DQuat::from_xyzw(x, y, z, w),
        };
        if self.diagnostics.iter().any(Diagnostic::is_error) || !self.fits(item, recipe.node_count()) {
            return None;
        }
        match weave::unfold(&recipe) {
            Ok(paths) => Some(Woven { recipe, paths, laws, warp: warp_of, weft: weft_of }),
            Err(error) => {
                self.refuse_weave(item, sett, weave, &error);
                None
            }
        }
    }

    /// Threads of a ply: sett times size, or repeats of the draft.
    fn threads(
        &mut self,
        item: &Item,
        weave: &Weave,
        draft: &crate::scene::Draft,
        sett: &Both<Given<f64>>,
    ) -> Option<(u32, u32)> {
        for sett in [&sett.warp, &sett.weft] {
            if !(**sett > 0.0 && sett.is_finite()) {
                self.diagnostics.push(Diagnostic::error(
                    "E0703",
                    "a sett is above zero",
                    sett.span(),
                    "threads per length",
                ));
                return None;
            }
        }
        let count = |size: f64, sett: f64| (size * sett).round();
        let (ends, picks, given) = match &weave.extent {
            Extent::Size(given) => {
                let [x, y] = given.value;
                self.take(format!("{}.size", item.name), given, format!("[{}, {}] mm", x * 1e3, y * 1e3));
                (count(x, *sett.warp), count(y, *sett.weft), given.origin)
            }
            Extent::Repeats(given) => {
                let [x, y] = given.value;
                self.take(format!("{}.repeats", item.name), given, format!("[{x}, {y}]"));
                (f64::from(x) * f64::from(draft.ends), f64::from(y) * f64::from(draft.picks), given.origin)
            }
        };
        if ends < 1.0 || picks < 1.0 {
            let message = format!("`{}` has no thread: {ends} ends and {picks} picks", item.name);
            let found = Diagnostic::error("E0704", message, given.span, "smaller than one thread")
                .note("Ends = sett of the warp × first size; picks = sett of the weft × second size.");
            self.diagnostics.push(found);
            return None;
        }
        // Above this the node count is refused anyway; it keeps the cast exact.
        Some((ends.min(4e9) as u32, picks.min(4e9) as u32))
    }

    /// Laws of a family's yarns, and which law each thread follows.
    fn thread_laws(&mut self, threads: &Threads, count: u32, laws: &mut Vec<YarnLaw>, of: &mut Vec<u32>) {
        let first = laws.len();
        let mut index = Vec::new();
        for yarn in &threads.yarns {
            let law = self.law(yarn);
            // Warp and weft of one yarn share its law.
            let same = |known: &YarnLaw| YarnLaw { origin: law.origin, ..known.clone() } == law;
            let at = laws[..first].iter().position(same).unwrap_or_else(|| {
                laws.push(law.clone());
                laws.len() - 1
            });
            index.push(at as u32);
        }
        of.extend((0..count as usize).map(|thread| index[threads.of[thread % threads.of.len()] as usize]));
    }

    pub(super) fn fits(&mut self, item: &Item, nodes: usize) -> bool {
        if nodes <= MOST_NODES {
            return true;
        }
        let gigabytes = nodes as f64 * 400.0 / 1e9;
        let message = format!("`{}` would have {nodes} nodes, about {gigabytes:.0} GB", item.name);
        let found = Diagnostic::error("E0705", message, item.span, format!("at most {MOST_NODES} nodes run"))
            .note("Check the units of `size` and `sett`, or take fewer nodes per crossing.");
        self.diagnostics.push(found);
        false
    }

    fn refuse_weave(&mut self, item: &Item, sett: &Both<Given<f64>>, weave: &Weave, error: &WeaveError) {
        let place = |family: &Family| match family {
            Family::Warp => sett.warp.span(),
            Family::Weft => sett.weft.span(),
        };
        let found = match error {
            WeaveError::Empty { what } => Diagnostic::error(
                "E0706",
                format!("`{}` needs a {what}", item.name),
                weave.nodes_per_crossing.span(),
                "",
            ),
            WeaveError::NeighboursOverlap { family, spacing, needed } => {
                let message = format!("the yarns of `{}` are wider than their spacing", item.name);
                let label = format!("{:.4} mm apart, {:.4} mm wide", spacing * 1e3, needed * 1e3);
                Diagnostic::error("E0707", message, place(family), label)
                    .note(format!("At most {:.2} /cm fit, or take a finer yarn.", 0.01 / needed))
            }
            WeaveError::Jammed { family, spacing, needed } => {
                let message = format!("`{}` is jammed: its threads cannot bend round each other", item.name);
                Diagnostic::error("E0708", message, place(family), format!("{:.4} mm apart", spacing * 1e3)).note(format!(
                    "By Peirce's geometry of round yarns they need {:.4} mm, {:.2} /cm; flatter or finer yarns allow more.",
                    needed * 1e3,
                    0.01 / needed
                ))
            }
        };
        self.diagnostics.push(found);
    }

    /// A ply tiled from the final state of a weave in another case. The plan names the state by the hash of the plan that
    /// makes it: runs are deterministic, so that hash stands for the state.
    fn tiled(&mut self, item: &Item, weave: &Weave, source: &Given<CellSource>) -> Option<(Recipe, Unfolded)> {
        let case = &self.program.cases[source.case.0 as usize];
        let name = case.scene.item(source.item).name.clone();
        let input = format!("final({}.{name})", case.name.as_deref().unwrap_or("?"));
        self.take(format!("{}.cell", item.name), source, &input);
        let mut silent = Vec::new();
        let Some(plan) = super::make(self.sources, self.program, case, self.options, &mut silent) else {
            let message = format!("`{input}` cannot be planned");
            self.diagnostics.push(Diagnostic::error("E0815", message, source.span(), "its case has errors"));
            return None;
        };
        let domain = plan.body.domains.iter().find(|domain| domain.name == name);
        let Some(Recipe::Weave { paths: cell, laws, warp, weft, .. }) = domain.map(|domain| &domain.recipe) else {
            let message = format!("`{name}` is not woven from a draft");
            self.diagnostics.push(Diagnostic::error(
                "E0816",
                message,
                source.span(),
                "a cell is a weave with a `pattern`",
            ));
            return None;
        };
        self.body.inputs.insert(input.clone(), format!("plan {}", plan.hash));
        let (cell, laws) = (cell.clone(), laws.clone());
        let repeats = self.tile_repeats(item, weave, &cell, source)?;
        let ply = WeaveRecipe {
            ends: cell.draft.ends as u32 * repeats[0],
            picks: cell.draft.picks as u32 * repeats[1],
            origin: DVec3::from_array(*weave.position),
            ..cell.clone()
        };
        if !self.fits(item, ply.node_count()) {
            return None;
        }
        let paths = weave::unfold(&ply).ok()?;
        let unfolded = unfold(&ply, &paths, &laws, &warp[..], &weft[..]);
        let velocity = self.velocity(item, &weave.velocity);
        let recipe = Recipe::Tiled {
            input,
            repeats,
            origin: *weave.position,
            warp: unfolded.laws_of(Family::Warp),
            weft: unfolded.laws_of(Family::Weft),
            cell,
            laws,
            velocity,
        };
        Some((recipe, unfolded))
    }

    /// Repeats of the draft in a tiled ply: size over the cell's woven period.
    fn tile_repeats(
        &mut self,
        item: &Item,
        weave: &Weave,
        cell: &WeaveRecipe,
        source: &Given<CellSource>,
    ) -> Option<[u32; 2]> {
        if (cell.ends as usize) < 2 * cell.draft.ends || (cell.picks as usize) < 2 * cell.draft.picks {
            let found = Diagnostic::error("E0709", "a cell to tile holds at least two repeats each way", source.span(), "too small")
                .note("The middle repeat is tiled; its period is measured to the next one. `repeats = [4, 4]` is a good cell.");
            self.diagnostics.push(found);
            return None;
        }
        let repeats = match &weave.extent {
            Extent::Repeats(given) => given.value,
            Extent::Size(given) => {
                let [x, y] = given.value;
                self.take(format!("{}.size", item.name), given, format!("[{}, {}] mm", x * 1e3, y * 1e3));
                let count = |size: f64, period: f64| (size / period).round().clamp(0.0, 4e9) as u32;
                [
                    count(x, cell.end_spacing * cell.draft.ends as f64),
                    count(y, cell.pick_spacing * cell.draft.picks as f64),
                ]
            }
        };
        if repeats.contains(&0) {
            self.diagnostics.push(Diagnostic::error(
                "E0704",
                format!("`{}` is smaller than one repeat", item.name),
                item.span,
                "",
            ));
            return None;
        }
        Some(repeats)
    }

    fn strand(&mut self, item: &Item, strand: &Strand) -> Option<(Recipe, Unfolded)> {
        let [from, to] = strand.between.value.map(DVec3::from_array);
        let length = from.distance(to);
        self.take(format!("{}.between", item.name), &strand.between, format!("{} mm", length * 1e3));
        self.take(format!("{}.cell", item.name), &strand.cell, format!("{} mm", *strand.cell * 1e3));
        if length <= 0.0 || !length.is_finite() {
            self.diagnostics.push(Diagnostic::error(
                "E0710",
                format!("`{}` has no length", item.name),
                strand.between.span(),
                "both ends are one point",
            ));
            return None;
        }
        if !(*strand.cell > 0.0 && *strand.cell <= length) {
            self.diagnostics.push(Diagnostic::error(
                "E0719",
                "a cell is above zero and at most the strand's length",
                strand.cell.span(),
                "does not fit",
            ));
            return None;
        }
        let segments = (length / *strand.cell).round().max(1.0);
        if !self.fits(item, segments.min(1e18) as usize) {
            return None;
        }
        let law = self.law(&strand.yarn);
        let velocity = self.velocity(item, &strand.velocity);
        let paths = weave::strand(from, to, segments as u32);
        let nodes = 0..paths.positions.len() as u32;
        let unfolded = Unfolded {
            domain: DomainId(0),
            yarns: vec![UnfoldedYarn { family: Family::Warp, thread: 0, nodes, law: 0 }],
            laws: vec![law.clone()],
            positions: paths.positions,
            rest_length: paths.rest_length,
            pitch: 2.0 * law.half_width,
        };
        Some((Recipe::Strand { from: from.into(), to: to.into(), segments: segments as u32, law, velocity }, unfolded))
    }

    pub(super) fn velocity(&mut self, item: &Item, given: &Given<[f64; 3]>) -> [f64; 3] {
        let [x, y, z] = given.value;
        self.take(format!("{}.velocity", item.name), given, format!("[{x}, {y}, {z}] m/s"));
        given.value
    }

    /// Whether the run only looks for an equilibrium.
    pub(super) fn is_static(extent: &Extents) -> bool {
        matches!(extent, Extents::Static(_))
    }
}

/// A recipe, its unfolded paths and the laws of its threads.
struct Woven {
    recipe: WeaveRecipe,
    paths: WeavePaths,
    laws: Vec<YarnLaw>,
    warp: Vec<u32>,
    weft: Vec<u32>,
}

fn unfold(recipe: &WeaveRecipe, paths: &WeavePaths, laws: &[YarnLaw], warp: &[u32], weft: &[u32]) -> Unfolded {
    let yarns = paths
        .yarns
        .iter()
        .map(|yarn| {
            let of = if yarn.family == Family::Warp { warp } else { weft };
            let law = of[yarn.thread as usize % of.len()];
            UnfoldedYarn {
                family: yarn.family,
                thread: yarn.thread,
                nodes: yarn.nodes.start as u32..yarn.nodes.end as u32,
                law,
            }
        })
        .collect();
    Unfolded {
        domain: DomainId(0),
        yarns,
        laws: laws.to_vec(),
        positions: paths.positions.clone(),
        rest_length: paths.rest_length.clone(),
        pitch: 0.5 * (recipe.end_spacing + recipe.pick_spacing),
    }
}

impl Unfolded {
    /// The law of each thread of a family, in order.
    fn laws_of(&self, family: Family) -> Vec<u32> {
        self.yarns.iter().filter(|yarn| yarn.family == family).map(|yarn| yarn.law).collect()
    }
}
