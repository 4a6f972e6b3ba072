//! The registry of peers: one line each.

#[cfg(not(target_family = "wasm"))]
use super::embree::Embree;
use super::{BuiltPeer, Peer, obvhs::Obvhs, ray_query::RayQuery};
use raystone_accel::TriangleSoup;
use raystone_config::NO_PEER;
use raystone_core::params::{Kinds, Named};
use raystone_gpu::Gpu;

/// Everything nameable on the `peer` axis.
pub type PeerRegistry = Kinds<dyn Peer>;

struct NoPeer;

impl Peer for NoPeer {
    fn name(&self) -> &'static str {
        NO_PEER
    }

    fn description(&self) -> &'static str {
        "nobody to compare with"
    }

    fn build<'a>(&self, _: &Gpu, _: &'a TriangleSoup) -> Result<Box<dyn BuiltPeer + 'a>, String> {
        Err("nobody was asked for".into())
    }
}

impl Named for dyn Peer {
    fn built_in() -> Vec<&'static Self> {
        vec![
            &NoPeer,
            &Obvhs::Binary,
            &Obvhs::Wide,
            #[cfg(not(target_family = "wasm"))]
            &Embree,
            &RayQuery,
        ]
    }

    fn name(&self) -> &'static str {
        Peer::name(self)
    }

    fn description(&self) -> &'static str {
        Peer::description(self)
    }
}
