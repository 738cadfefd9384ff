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
    pub scene_views: watch::Receiver<Option<Arc<SceneView>>>,
    pub send_command: Arc<dyn Fn(Command) -> Option<u64> + Send + Sync>,
    pub submit_reference: Arc<dyn Fn(Reference) -> bool + Send + Sync>,
    pub viewer_slots: Arc<Semaphore>,
    pub viewers: Viewers,
}
