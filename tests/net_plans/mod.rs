//! Plans of lines, points and sheets made by hand, on top of those for chains.
#![allow(dead_code)]

#[path = "../chain_plans/mod.rs"]
pub mod chain_plans;

pub use chain_plans::Draft;
use ripstop::backend::cpu::{Inputs, RunOptions, run};
use ripstop::backend::{Observer, Outcome, Silent, State};
use ripstop::geometry::sheet::{Lay, LineRecipe, Mesh, Pattern, Placement, SheetRecipe};
use ripstop::plan::{
    BendingLaw, CordLaw, DomainId, FabricLaw, Join, Kernel, MembraneLaw, Node, OriginId, Plan, PointRecipe, PointRef,
    Recipe, Scheme,
};

pub const GRAVITY: f64 = 9.80665;

/// A cord from EA (N) and kg/m that pulls and pushes; see [`CordLaw`].
pub fn cord(stiffness: f64, linear_density: f64) -> CordLaw {
    CordLaw {
        name: "cord".into(),
        linear_density,
        stiffness,
        strength: None,
        tension_only: false,
        damping: 0.0,
        origin: OriginId(0),
    }
}

/// A cloth from E·t (N/m), ν and kg/m².
pub fn fabric(stiffness: f64, poisson: f64, areal_density: f64) -> FabricLaw {
    FabricLaw {
        name: "cloth".into(),
        areal_density,
        membrane: MembraneLaw::Isotropic { stiffness, poisson },
        bending: None::<BendingLaw>,
        damping: 0.0,
        origin: OriginId(0),
    }
}

pub fn point(position: [f64; 3], velocity: [f64; 3], mass: f64) -> PointRecipe {
    PointRecipe { name: "bob".into(), position, velocity, mass, origin: OriginId(0) }
}

/// What a plan of the net is stepped by.
#[derive(Clone, Copy)]
pub enum Step {
    Leapfrog,
    Whole(Scheme),
}

impl Draft {
    pub fn line(&mut self, name: &str, law: CordLaw, through: Vec<[f64; 3]>, length: f64, segments: u32) -> DomainId {
        let segments = vec![segments; through.len() - 1];
        let path =
            LineRecipe { through, length, segments, closed: false, slides: false, gravity: [0.0, 0.0, -GRAVITY] };
        self.domain(name, Recipe::Line { path, law, velocity: [0.0; 3] }, 1024)
    }

    pub fn points(&mut self, points: Vec<PointRecipe>) -> DomainId {
        self.domain("points", Recipe::Points(points), 1024)
    }

    pub fn sheet(&mut self, name: &str, law: FabricLaw, size: [f64; 2], cell: f64) -> DomainId {
        let placement = Placement { origin: [0.0; 3], turn: [0.0, 0.0, 0.0, 1.0] };
        let pattern = Pattern::Rectangle { size };
        let mesh = SheetRecipe { pattern, mesh: Mesh::Triangles, cell, grain: 0.0, lay: Lay::Flat, placement };
        self.domain(name, Recipe::Sheet { mesh, law, velocity: [0.0; 3] }, 1024)
    }

    pub fn tie(&mut self, domain: DomainId, node: u32, to: PointRef) {
        let name = format!("tie {}", self.body.joins.len());
        self.body.joins.push(Join::Tie { name, domain, node, to, origin: OriginId(0) });
    }

    pub fn gravity(&mut self) -> Node {
        self.pass(Kernel::Gravity { acceleration: [0.0, 0.0, -GRAVITY] })
    }

    /// Runs the passes by a scheme for `duration` s.
    pub fn steps(&mut self, by: Step, passes: Vec<Node>, step: f64, duration: f64) {
        match by {
            Step::Leapfrog => self.leapfrog(passes, Vec::new(), step, duration),
            Step::Whole(scheme) => {
                let mut each = passes;
                each.push(self.pass(Kernel::Integrate(scheme)));
                each.extend([Node::Commit, Node::Emit]);
                let each = Box::new(Node::Seq(each));
                self.body.schedule = Node::Run { step, duration: Some(duration), most_steps: u64::MAX, each };
            }
        }
    }
}

/// Runs to the end and tells every accepted ledger row and probe to `observer`.
pub fn run_with(plan: &Plan, threads: usize, resume: Option<&State>, observer: &mut dyn Observer) -> Outcome {
    let options = RunOptions { threads, resume, ..RunOptions::default() };
    let outcome = match run(plan, &Inputs::default(), options, observer) {
        Ok(outcome) => outcome,
        Err(refusal) => panic!("refused: {}", refusal.message),
    };
    assert!(outcome.halt.is_none(), "{:?}", outcome.halt);
    outcome
}

pub fn run_to_end(plan: &Plan, threads: usize) -> Outcome {
    run_with(plan, threads, None, &mut Silent)
}

/// Every value of one probe with its time.
#[derive(Default)]
pub struct Rows(pub Vec<(f64, ripstop::backend::Value)>);

impl Observer for Rows {
    fn probe_row(&mut self, _sink: usize, time: f64, value: ripstop::backend::Value) {
        self.0.push((time, value));
    }
}
