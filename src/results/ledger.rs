//! The energy ledger as CSV: at each time a line for each part and one for their total, J.

use super::folder::{Folder, Lines};
use super::probes::cell;
use crate::backend::{Balance, Ledger};
use crate::diagnostics::Diagnostic;

/// The ledger's name in a run's folder.
pub const FILE: &str = "ledger.csv";

/// The growing file.
#[derive(Debug)]
pub struct LedgerFile(Lines);

impl LedgerFile {
    pub fn new(folder: &Folder) -> Result<Self, Diagnostic> {
        let mut lines = folder.lines(FILE)?;
        let columns = Balance::COLUMNS.map(|name| format!("{name} [J]")).join(",");
        lines.add(&format!("time [s],step,part,{columns},closure"))?;
        Ok(Self(lines))
    }

    pub fn add(&mut self, time: f64, step: u64, ledger: &Ledger) -> Result<(), Diagnostic> {
        let row = |part: &str, balance: &Balance| {
            let values = balance.values().map(|v| format!("{v:?}")).join(",");
            format!("{time:?},{step},{},{values}", cell(part))
        };
        for account in &ledger.accounts {
            self.0.add(&format!("{},", row(&account.part, &account.now)))?;
        }
        self.0.add(&format!("{},{:?}", row("total", &ledger.total()), ledger.closure()))
    }

    pub fn flush(&mut self) -> Result<(), Diagnostic> {
        self.0.flush()
    }
}
