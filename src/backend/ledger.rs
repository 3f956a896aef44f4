//! The energy ledger: what each part has, and what it received through every work-doing pass, exact in the scheme.
//!
//! With half-step velocities v⁻, v⁺ and positions xₙ, the kinetic energy at xₙ is Kₙ = ½m|v⁻|² + ½h·f·v⁻ (f the elastic
//! force at xₙ), and every other impulse J books J·(v⁻ + v⁺)/2. Then Kₙ₊₁ − Kₙ equals ½(fₙ + fₙ₊₁)·(xₙ₊₁ − xₙ) plus what
//! is booked, identically: only the trapezoid's error against the stored energy is left as the residual.

use serde::{Deserialize, Serialize};

/// Energy of one part, J. The entries after `initial` are what the part received so far (a loss is negative): summed
/// over all parts, contact, viscosity, breaking and settling are therefore never positive but for rounding. A node that
/// several parts of the net share keeps its books with the first of them, so that there only the sum over parts closes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Balance {
    pub kinetic: f64,
    /// Elastic energy of what is whole: ½EAε²L over segments, strain energy of sheets and seams.
    pub stored: f64,
    /// Kinetic plus stored at the start.
    pub initial: f64,
    /// Bulk viscosity of yarns, damping of sheets and lines.
    pub viscosity: f64,
    pub contact: f64,
    pub breaking: f64,
    pub settling: f64,
    pub gravity: f64,
    /// Fixes, pulls, loads, and rest lengths that an action changes.
    pub drives: f64,
    pub air: f64,
    pub pressure: f64,
    /// What the integration rule itself took or made: zero for leapfrog, a loss for backward Euler.
    pub scheme: f64,
}

impl Balance {
    /// Names of [`Balance::values`], for tables.
    pub const COLUMNS: [&'static str; 13] = [
        "kinetic",
        "stored",
        "initial",
        "viscosity",
        "contact",
        "breaking",
        "settling",
        "gravity",
        "drives",
        "air",
        "pressure",
        "scheme",
        "residual",
    ];

    /// J, in the order of [`Balance::COLUMNS`].
    pub fn values(&self) -> [f64; 13] {
        [
            self.kinetic,
            self.stored,
            self.initial,
            self.viscosity,
            self.contact,
            self.breaking,
            self.settling,
            self.gravity,
            self.drives,
            self.air,
            self.pressure,
            self.scheme,
            self.residual(),
        ]
    }

    /// Everything received since the start, J.
    pub fn received(&self) -> f64 {
        let lost = self.viscosity + self.contact + self.breaking + self.settling;
        lost + self.gravity + self.drives + self.air + self.pressure + self.scheme
    }

    /// What the books do not explain, J.
    pub fn residual(&self) -> f64 {
        self.kinetic + self.stored - self.initial - self.received()
    }

    /// Lost for good, J: viscosity, contact, breaking and settling. Meaningful for the sum over parts; in one part,
    /// contact also hands energy over.
    pub fn dissipated(&self) -> f64 {
        -(self.viscosity + self.contact + self.breaking + self.settling)
    }

    /// Entry by entry.
    pub fn plus(&self, other: &Balance) -> Balance {
        Balance {
            kinetic: self.kinetic + other.kinetic,
            stored: self.stored + other.stored,
            initial: self.initial + other.initial,
            viscosity: self.viscosity + other.viscosity,
            contact: self.contact + other.contact,
            breaking: self.breaking + other.breaking,
            settling: self.settling + other.settling,
            gravity: self.gravity + other.gravity,
            drives: self.drives + other.drives,
            air: self.air + other.air,
            pressure: self.pressure + other.pressure,
            scheme: self.scheme + other.scheme,
        }
    }
}

/// A part's balance and the peaks that the closure is measured by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Account {
    /// The part's name in the scene.
    pub part: String,
    pub now: Balance,
    /// Kinetic energy at the start, J.
    pub kinetic_at_start: f64,
    pub peak_stored: f64,
    /// Largest kinetic − kinetic_at_start so far, at least 0, J.
    pub peak_kinetic_gain: f64,
}

impl Account {
    /// Takes the energies measured at one time.
    pub fn measured(&mut self, kinetic: f64, stored: f64) {
        self.now.kinetic = kinetic;
        self.now.stored = stored;
        self.peak_stored = self.peak_stored.max(stored);
        self.peak_kinetic_gain = self.peak_kinetic_gain.max(kinetic - self.kinetic_at_start);
    }

    /// Opens the account with the energies at the start.
    pub fn open(&mut self, kinetic: f64, stored: f64) {
        self.now.initial = kinetic + stored;
        self.kinetic_at_start = kinetic;
        // Measurements before the start gained nothing.
        (self.peak_stored, self.peak_kinetic_gain) = (0.0, 0.0);
        self.measured(kinetic, stored);
    }
}

/// All accounts: chain domains in plan order, then bodies, then domains of the net in plan order.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ledger {
    pub accounts: Vec<Account>,
}

impl Ledger {
    /// The sum over parts.
    pub fn total(&self) -> Balance {
        self.accounts.iter().fold(Balance::default(), |sum, account| sum.plus(&account.now))
    }

    /// Energy exchanged, J: Σ over parts of the peak stored energy and the peak gain of kinetic energy, plus what was
    /// dissipated.
    pub fn exchanged(&self) -> f64 {
        let peaks: f64 = self.accounts.iter().map(|account| account.peak_stored + account.peak_kinetic_gain).sum();
        peaks + self.total().dissipated().max(0.0)
    }

    /// |residual| over the energy exchanged (1). The denominator is at least 10⁻⁹ of the first energy, so that a scene
    /// in which nothing happens closes at its rounding.
    pub fn closure(&self) -> f64 {
        let total = self.total();
        let scale = self.exchanged().max(1e-9 * total.initial.abs());
        if scale > 0.0 { total.residual().abs() / scale } else { 0.0 }
    }
}
