//! Resources that all requests to the server share.

use std::sync::Arc;

use tokio::sync::{Semaphore, watch};

use super::guard::Guard;
use super::messages::{self, Command};
use super::object::SceneView;
use super::picture::Frame;
use super::reference::Reference;
use super::session::Viewers;
use super::times::Times;

#[derive(Clone)]
pub struct Shared {
    pub guard: Guard,
    pub state: watch::Receiver<Arc<messages::State>>,
    pub frames: watch::Receiver<Option<Arc<Frame>>>,
    pub times: Times,
    pub seen: watch::Receiver<Option<Arc<SceneView>>>,
    pub send: Arc<dyn Fn(Command) -> Option<u64> + Send + Sync>,
    pub give: Arc<dyn Fn(Reference) -> bool + Send + Sync>,
    pub seats: Arc<Semaphore>,
    pub viewers: Viewers,
}
