//! Engines that run a plan: the schedule of passes, the energy ledger, run-time watch, checkpoints and what is told
//! while a run goes on. `cpu` is the reference engine.

mod frame;
mod ledger;
mod observe;
mod state;

pub use frame::{BodyFrame, ChainFrame, Family, Frame, YarnFrame};
pub use ledger::{Account, Balance, Ledger};
pub use observe::{
    BodyEnd, Broken, ContactTotals, Finding, Halt, HaltReason, Judged, Observer, Outcome, Progress, Silent, Start,
    StepView, Timings, Value, VerifyHook,
};
pub use state::{BodyState, State};
