//! Sheets, lines and points as they lie at the start, each in its own numbering.

use glam::DVec3;

use crate::backend::cpu::Refusal;
use crate::geometry::sheet::{self, LinePath, SheetMesh};
use crate::plan::{Domain, DomainId, OriginId, Recipe};

/// One domain of the net before its nodes are numbered.
#[derive(Debug)]
pub struct Laid {
    pub domain: DomainId,
    pub name: String,
    pub origin: OriginId,
    /// m.
    pub position: Vec<DVec3>,
    /// m/s, by node.
    pub velocity: Vec<DVec3>,
    pub mesh: Option<SheetMesh>,
    pub path: Option<LinePath>,
}

/// Unfolds one domain; none where it is not of the net.
///
/// # Errors
/// What geometry refuses, at the domain's origin.
pub fn lay(id: DomainId, domain: &Domain) -> Result<Option<Laid>, Refusal> {
    let refuse = |error: &dyn std::fmt::Debug| {
        Refusal::new(format!("`{}` cannot be unfolded: {error:?}", domain.name), Some(domain.origin))
    };
    let mut laid = Laid {
        domain: id,
        name: domain.name.clone(),
        origin: domain.origin,
        position: Vec::new(),
        velocity: Vec::new(),
        mesh: None,
        path: None,
    };
    let velocity = match &domain.recipe {
        Recipe::Sheet { mesh, velocity, .. } => {
            let mesh = sheet::unfold(mesh).map_err(|error| refuse(&error))?;
            laid.position.clone_from(&mesh.position);
            laid.mesh = Some(mesh);
            DVec3::from_array(*velocity)
        }
        Recipe::Line { path, velocity, .. } => {
            let path = sheet::unfold_line(path).map_err(|error| refuse(&error))?;
            laid.position.clone_from(&path.position);
            laid.path = Some(path);
            DVec3::from_array(*velocity)
        }
        Recipe::Points(points) => {
            laid.position = points.iter().map(|point| DVec3::from_array(point.position)).collect();
            laid.velocity = points.iter().map(|point| DVec3::from_array(point.velocity)).collect();
            return Ok(Some(laid));
        }
        Recipe::Weave { .. } | Recipe::Tiled { .. } | Recipe::Strand { .. } | Recipe::Bodies(_) => return Ok(None),
    };
    laid.velocity = vec![velocity; laid.position.len()];
    Ok(Some(laid))
}
