//! Engines that run a plan: the schedule of passes, the energy ledger, run-time watch, checkpoints and what is told
//! while a run goes on. `cpu` is the reference engine.

pub mod cpu;
mod frame;
mod ledger;
mod observe;
pub mod solve;
mod state;
mod tape;

pub use frame::{BodyFrame, ChainFrame, Family, Frame, LineFrame, PointFrame, SheetFrame, YarnFrame};
pub use ledger::{Account, Balance, Ledger};
pub use observe::{
    BodyEnd, Broken, ClothTotals, ContactTotals, Finding, Halt, HaltReason, Judged, NetView, Observer, Outcome,
    Progress, Silent, Start, StepView, Timings, Value, VerifyHook,
};
pub use state::{ActionState, BodyState, NetState, State};
pub use tape::{Accumulator, Memory, RunningTape};
