//! A request of a page, and the page that awaits its answer.

use serde_json::{Map, Value};
use tokio::sync::mpsc::Sender;

use crate::requests::PageRequest;

/// A queued request of a page.
#[derive(Debug)]
pub(crate) struct QueuedRequest {
    /// The page's number, which identifies its hand in the workspace.
    pub(crate) page: u16,
    pub(crate) page_request: PageRequest,
    pub(crate) requester: Requester,
}

/// A page, with the number of its request.
#[derive(Clone, Debug)]
pub(crate) struct Requester {
    pub(crate) page: Sender<String>,
    /// `None` if the page is closed and no answer is needed.
    pub(crate) id: Option<u64>,
}

impl Requester {
    /// Answers the page. The answer is dropped if the page's queue is full.
    pub(crate) fn answer(&self, result: Result<Option<(&str, &str)>, &str>) {
        let Some(id) = self.id else { return };
        let (outcome, extra) = match result {
            Ok(extra) => (("ok", Value::from(true)), extra),
            Err(why) => (("error", Value::from(why)), None),
        };
        let extra = extra.map(|(name, value)| (name, Value::from(value)));
        let fields = [("answer", Value::from(id)), outcome].into_iter().chain(extra);
        let answer: Map<String, Value> = fields.map(|(name, value)| (name.to_owned(), value)).collect();
        let _unread = self.page.try_send(Value::from(answer).to_string());
    }
}
