//! Plans made by hand for the chain's verification: strands and bodies, with no language in between.

use ripstop::backend::cpu::{Inputs, RunOptions, run};
use ripstop::backend::{Outcome, Silent};
use ripstop::diagnostics::{FileId, Span};
use ripstop::plan::{
    Advice, Axes, Body, BreakLaw, Cost, Domain, DomainId, Drive, Kernel, Node, NodeSet, Op, OriginId, OriginRecord,
    Pass, PassId, Plan, Recipe, SCHEMA, Slot, Tape, TapeId, Timing, Topology, YarnLaw,
};
use ripstop::scene::How;

/// A plan under construction.
pub struct Draft {
    pub body: Body,
}

pub const ALWAYS: Timing = Timing { at: 0.0, delay: 0.0, when: None, until: None, during: None };

/// A yarn from its modulus (Pa), density (kg/m³) and linear density (kg/m).
pub fn law(name: &str, modulus: f64, density: f64, linear_density: f64) -> YarnLaw {
    YarnLaw {
        name: name.into(),
        linear_density,
        axial_stiffness: modulus * linear_density / density,
        half_thickness: 1e-4,
        half_width: 1e-4,
        breaks: None,
        flattening: None,
        friction: None,
        origin: OriginId(0),
    }
}

pub fn breaking(law: YarnLaw, strain: f64) -> YarnLaw {
    YarnLaw { breaks: Some(BreakLaw { strain, weibull: None, said: "strain".into() }), ..law }
}

impl Draft {
    pub fn new() -> Self {
        Self { body: Body { title: "by hand".into(), ..Body::default() } }
    }

    pub fn domain(&mut self, name: &str, recipe: Recipe, block: u32) -> DomainId {
        let domain = Domain {
            name: name.into(),
            recipe,
            topology: Topology::Breaks,
            block,
            nodes: 0,
            pieces: 1,
            origin: OriginId(0),
        };
        self.body.domains.push(domain);
        DomainId(self.body.domains.len() as u32 - 1)
    }

    pub fn strand(&mut self, law: YarnLaw, length: f64, segments: u32, velocity: [f64; 3]) -> DomainId {
        let recipe = Recipe::Strand { from: [0.0; 3], to: [length, 0.0, 0.0], segments, law, velocity };
        self.domain("yarn", recipe, 512)
    }

    pub fn pass(&mut self, kernel: Kernel) -> Node {
        self.named_pass("pass", kernel)
    }

    pub fn named_pass(&mut self, name: &str, kernel: Kernel) -> Node {
        let (reads, writes, ledger) = (Vec::new(), Vec::new(), Vec::new());
        let cost = Cost { bytes: 0.0, flops: 0.0 };
        self.body.passes.push(Pass { name: name.into(), kernel, reads, writes, ledger, cost, origin: OriginId(0) });
        Node::Pass(PassId(self.body.passes.len() as u32 - 1))
    }

    pub fn constant(&mut self, [x, y, z]: [f64; 3]) -> TapeId {
        let ops = vec![Op::Number(x), Op::Number(y), Op::Number(z), Op::Vector([Slot(0), Slot(1), Slot(2)])];
        self.tape(ops)
    }

    pub fn tape(&mut self, ops: Vec<Op>) -> TapeId {
        self.body.tapes.push(Tape { name: "tape".into(), ops });
        TapeId(self.body.tapes.len() as u32 - 1)
    }

    pub fn fix(&mut self, domain: DomainId, ranges: Vec<[u32; 2]>) -> Node {
        let nodes = vec![NodeSet { domain: domain.0, ranges }];
        self.pass(Kernel::Fix { nodes, axes: Axes([true; 3]), timing: ALWAYS })
    }

    /// Pulls a yarn's end outward with `tension` N.
    pub fn pull_end(&mut self, domain: DomainId, node: u32, tension: f64) -> Node {
        let tape = self.tape(vec![Op::Number(tension)]);
        let nodes = vec![NodeSet { domain: domain.0, ranges: vec![[node, node + 1]] }];
        self.pass(Kernel::Drive { nodes, drive: Drive::EndTension { tape, pitch: vec![1.0] }, timing: ALWAYS })
    }

    pub fn drive(&mut self, domain: DomainId, node: u32, velocity: [f64; 3]) -> Node {
        let tape = self.constant(velocity);
        let nodes = vec![NodeSet { domain: domain.0, ranges: vec![[node, node + 1]] }];
        self.pass(Kernel::Drive { nodes, drive: Drive::Velocity(tape), timing: ALWAYS })
    }

    /// Leapfrog over the given passes, then drift, the passes after it, commit and emit.
    pub fn leapfrog(&mut self, before: Vec<Node>, after: Vec<Node>, step: f64, duration: f64) {
        let mut each = before;
        each.push(self.pass(Kernel::Kick));
        each.push(self.pass(Kernel::Drift));
        each.extend(after);
        each.extend([Node::Commit, Node::Emit]);
        let half = self.pass(Kernel::HalfKick);
        let each = Box::new(Node::Seq(each));
        let run = Node::Run { step, duration: Some(duration), most_steps: u64::MAX, each };
        self.body.schedule = Node::Seq(vec![half, run]);
    }

    pub fn finish(self) -> Plan {
        let span = Span { file: FileId(0), start: 0, end: 0 };
        let origins = vec![OriginRecord { place: "by hand:1:1".into(), span, how: How::Written }];
        Plan { schema: SCHEMA, hash: "by hand".into(), body: self.body, origins, advice: Advice::default() }
    }
}

/// The stable step of a uniform chain with bulk viscosity b, times 0.9.
pub fn safe_step(law: &YarnLaw, segment: f64, b: f64) -> f64 {
    let wave = (law.axial_stiffness / law.linear_density).sqrt();
    0.9 * segment / wave * ((1.0 + b * b).sqrt() - b)
}

/// Runs and expects that it went to its end.
pub fn run_to_end(plan: &Plan, threads: usize) -> Outcome {
    let options = RunOptions { threads, ..RunOptions::default() };
    let outcome = match run(plan, &Inputs::default(), options, &mut Silent) {
        Ok(outcome) => outcome,
        Err(refusal) => panic!("refused: {}", refusal.message),
    };
    assert!(outcome.halt.is_none(), "{:?}", outcome.halt);
    outcome
}
