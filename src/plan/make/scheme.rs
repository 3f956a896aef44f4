//! How the run steps: leapfrog or a scheme that takes the whole step, and what bounds its step.

use crate::diagnostics::Diagnostic;
use crate::plan::{OriginId, Scheme, cost};
use crate::scene::{Extents, Integrator, Run, Step};

use super::Maker;
use super::net::Form;

/// Steps of an implicit scheme over the explicit bound, where the scene leaves them open.
const IMPLICIT_OVER: f64 = 100.0;

/// A run has at least so many implicit steps: more of the motion would be lost between two.
const LEAST_STEPS: f64 = 200.0;

/// Share of the stable step that sheets and lines take: their frequency rises with their strain.
pub(super) const NET_SHARE: f64 = 0.8;

/// How a run steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stepping {
    /// Velocities stand at half steps.
    pub leapfrog: bool,
    pub scheme: Option<Scheme>,
    /// A static net without anything that only dynamics finds.
    pub equilibrium: bool,
    /// Stable step over leapfrog's; infinite where none bounds it.
    pub reach: f64,
    /// The step where stiff parts take sub-steps, s.
    pub two_rates: Option<f64>,
}

impl Stepping {
    /// Why sheets, lines and bodies do not touch in this run; none where they do.
    pub fn knows_no_contact(&self) -> Option<&'static str> {
        if self.equilibrium {
            return Some("a static run of sheets and lines knows no contact yet");
        }
        // They take steps of their own within a step; contact corrects whole ones.
        match self.scheme {
            Some(Scheme::Embedded { .. }) => Some("`adaptive` knows no contact yet"),
            Some(Scheme::Multirate { .. }) => Some("`multirate` knows no contact yet"),
            _ => None,
        }
    }
}

impl Maker<'_> {
    /// Chooses the scheme and says why; `bound` is the stable step of leapfrog (s).
    pub(super) fn stepping(&mut self, run: &Run, run_origin: OriginId, chains: bool, bound: f64) -> Stepping {
        let integrator = run.integrator.value;
        let origin = self.take("run.integrator", &run.integrator, integrator_text(integrator));
        let over = matches!(run.step.value, Step::Fixed(step) if step > bound);
        let alone = !self.pieces.is_empty() && !chains;
        let residual = run.residual.value;
        let implicit = Scheme::BackwardEuler { residual };
        let fixed = match run.step.value {
            Step::Fixed(step) => Some(step),
            Step::Auto => None,
        };
        let still = Self::is_static(&run.extent);
        let net_alone = alone && !still;
        let forced = (integrator == Integrator::Multirate && net_alone).then(|| self.rates(fixed)).flatten();
        if integrator == Integrator::Auto && net_alone && fixed.is_none() {
            self.note_worthy_rates();
        }
        let (scheme, reason) = match integrator {
            Integrator::Auto if over && alone => (
                Some(implicit),
                "`auto` takes backward_euler: the step is over the stable bound of every explicit rule",
            ),
            Integrator::Multirate => (
                Some(Scheme::Multirate { substeps: forced.as_ref().map_or(1, |rates| rates.substeps) }),
                if forced.is_some() {
                    "multirate: the stiff parts take sub-steps"
                } else {
                    "multirate: all parts need one step, and none takes sub-steps"
                },
            ),
            Integrator::Auto => (
                None,
                "`auto` takes leapfrog: of second order at the cost of symplectic Euler, and it keeps energy over any time",
            ),
            Integrator::Leapfrog => (None, "leapfrog: velocities stand at half steps"),
            Integrator::SymplecticEuler => (None, "symplectic_euler: the first kick starts from the first velocities"),
            Integrator::Euler => (Some(Scheme::Euler), "euler takes the whole step"),
            Integrator::Rk4 => (Some(Scheme::Rk4), "rk4 takes the whole step"),
            Integrator::Adaptive => {
                (Some(Scheme::Embedded { tolerance: run.tolerance.value }), "adaptive takes the whole step")
            }
            Integrator::BackwardEuler | Integrator::Implicit => (Some(implicit), "backward_euler takes the whole step"),
            Integrator::Bdf2 => (Some(Scheme::Bdf2 { residual }), "bdf2 takes the whole step"),
            Integrator::Midpoint => (Some(Scheme::Midpoint { residual }), "midpoint takes the whole step"),
        };
        let leapfrog = scheme.is_none() && !matches!(integrator, Integrator::SymplecticEuler);
        self.decide("half_kick", "", leapfrog, reason, vec![origin]);
        if scheme.is_some() && chains {
            let found = Diagnostic::error(
                "E0854",
                "yarns do not run with this integrator",
                run.integrator.span(),
                "cannot run",
            )
            .note("`auto`, `leapfrog` and `symplectic_euler` run yarns; sheets and lines run with all of them.");
            self.diagnostics.push(found);
        }
        self.take_tolerances(run, scheme);
        if scheme == Some(Scheme::Euler) {
            self.warn_of_euler(run, run_origin, bound);
        }
        let equilibrium = still && alone && !self.pieces.iter().any(needs_dynamics);
        let rates = forced;
        let reach = rates.as_ref().map_or(reach(scheme), |rates| (rates.outer / rates.inner).min(rates.reach));
        if let Some(rates) = &rates {
            self.take_rates(rates);
        }
        let two_rates = rates.map(|rates| rates.step);
        Stepping { leapfrog, scheme: scheme.filter(|_| !still), equilibrium, reach, two_rates }
    }

    /// What the run would take by leapfrog and by an implicit rule, as a note of the plan. `auto` does not take the implicit
    /// one for a run in time by itself, even where it is cheaper: it damps what vibrates faster than its step, and whether
    /// that matters is the user's to say.
    pub(super) fn weigh_schemes(&mut self, run: &Run) {
        let Some(duration) = self.length_of(run) else { return };
        let bound = self.advice.bounds.iter().map(|bound| bound.step).fold(f64::INFINITY, f64::min);
        if self.pieces.is_empty() || !self.chain_domains().is_empty() || !bound.is_finite() || duration <= 0.0 {
            return;
        }
        if IMPLICIT_OVER.min(duration / LEAST_STEPS / bound) < 10.0 {
            return;
        }
        let [explicit, implicit] = cost::explicit_and_implicit(&self.body, self.advice.nodes);
        let steps = |step: f64| (duration / step).ceil();
        let far = (IMPLICIT_OVER * bound).min(duration / LEAST_STEPS);
        let [leap, back] = [steps(NET_SHARE * bound), steps(far)];
        let [by_leap, by_back] = [leap * explicit, back * implicit];
        self.advice.notes.push(format!(
            "leapfrog: {leap} steps, about {}; backward_euler: {back} steps of {:.0} times the bound, about {}",
            lasting(by_leap),
            far / bound,
            lasting(by_back)
        ));
    }

    fn take_tolerances(&mut self, run: &Run, scheme: Option<Scheme>) {
        let given = match scheme {
            Some(Scheme::Embedded { .. }) => Some(("tolerance", &run.tolerance)),
            Some(Scheme::BackwardEuler { .. } | Scheme::Bdf2 { .. } | Scheme::Midpoint { .. }) => {
                Some(("residual", &run.residual))
            }
            _ if Self::is_static(&run.extent) && !self.pieces.is_empty() => Some(("residual", &run.residual)),
            _ => None,
        };
        let Some((field, given)) = given else { return };
        self.take(format!("run.{field}"), given, given.value.to_string());
        if !(given.value > 0.0 && given.value < 1.0) {
            let message = format!("`{field}` is a share between 0 and 1");
            self.diagnostics.push(Diagnostic::error("E0743", message, given.span(), "outside 0 .. 1"));
        }
    }

    /// Explicit Euler multiplies the energy of a mode by 1 + (ωh)² a step, whatever the step.
    fn warn_of_euler(&mut self, run: &Run, _: OriginId, bound: f64) {
        let (Some(duration), true) = (self.length_of(run), bound.is_finite()) else { return };
        let step = match run.step.value {
            Step::Fixed(step) => step,
            Step::Auto => EULER_SHARE * bound,
        };
        let growth = 4.0 * step * duration / (bound * bound);
        if growth > 0.01 {
            let message = "explicit Euler feeds energy into every vibration, whatever the step";
            let found = Diagnostic::warning("W0765", message, run.integrator.span(), "not for more than a comparison")
                .note(format!(
                    "Undamped, the energy of the fastest vibration would grow by exp({growth:.3}) in this run. \
                     `symplectic_euler` costs the same and does not."
                ));
            self.diagnostics.push(found);
        }
    }

    /// The step that the compiler takes for a scheme whose bound is `bound` times its reach, s; None where the bound of
    /// leapfrog decides.
    pub(super) fn scheme_step(&self, run: &Run, stepping: &Stepping, bound: f64) -> Option<(f64, String)> {
        let duration = match run.extent {
            Extents::Static(_) => return None,
            _ => self.length_of(run).unwrap_or(f64::INFINITY),
        };
        match stepping.scheme? {
            Scheme::Euler => Some((EULER_SHARE * bound, format!("{EULER_SHARE} of the stable step of leapfrog"))),
            Scheme::Multirate { substeps } => {
                let step = stepping.two_rates.unwrap_or(NET_SHARE * bound);
                Some((step, format!("{substeps} sub-steps of the stiff parts, and under the stable step of the rest")))
            }
            Scheme::Rk4 => Some((NET_SHARE * stepping.reach * bound, format!("{NET_SHARE} of the stable step of rk4"))),
            Scheme::Embedded { .. } => Some((0.5 * bound, "half of the stable step to begin with".to_owned())),
            Scheme::BackwardEuler { .. } | Scheme::Bdf2 { .. } | Scheme::Midpoint { .. } => {
                let (far, least) = (IMPLICIT_OVER * bound, duration / LEAST_STEPS);
                Some(if far < least {
                    (far, format!("{IMPLICIT_OVER} times the stable step of leapfrog"))
                } else {
                    (least, format!("one of {LEAST_STEPS} of the run"))
                })
            }
        }
    }
}

/// `40 s`, `12 min`, `3.2 h`.
fn lasting(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.1} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// Share of leapfrog's stable step that explicit Euler takes.
const EULER_SHARE: f64 = 0.02;

/// Springs whose elongation is capped by moving nodes have no energy to make smallest.
fn needs_dynamics(piece: &super::net::Piece) -> bool {
    use crate::plan::MembraneLaw::{Particles, Springs};
    matches!(&piece.form, Form::Sheet { law, .. } if matches!(law.membrane, Springs { .. } | Particles { .. }))
}

/// Stable step over that of leapfrog, 2/ω: rk4 is stable up to 2√2/ω on the imaginary axis.
fn reach(scheme: Option<Scheme>) -> f64 {
    match scheme {
        None | Some(Scheme::Euler | Scheme::Multirate { .. }) => 1.0,
        Some(Scheme::Rk4) => std::f64::consts::SQRT_2,
        Some(_) => f64::INFINITY,
    }
}

fn integrator_text(integrator: Integrator) -> &'static str {
    match integrator {
        Integrator::Auto => "auto",
        Integrator::SymplecticEuler => "symplectic_euler",
        Integrator::Leapfrog => "leapfrog",
        Integrator::Euler => "euler",
        Integrator::Rk4 => "rk4",
        Integrator::Adaptive => "adaptive",
        Integrator::Multirate => "multirate",
        Integrator::BackwardEuler => "backward_euler",
        Integrator::Bdf2 => "bdf2",
        Integrator::Midpoint => "midpoint",
        Integrator::Implicit => "implicit",
    }
}
