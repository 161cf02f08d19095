//! What the supervisor tells the processes that it starts.

use std::path::PathBuf;

use clap::Args;
use process::Launch;

/// What the supervisor tells a process beside its domain and its configuration.
#[derive(Args, Clone, Debug)]
pub(crate) struct LaunchArgs {
    #[arg(long, hide = true, default_value_t = 1)]
    incarnation: u64,
    #[arg(long, hide = true)]
    parent: Option<i32>,
    #[arg(long, hide = true)]
    kept: Option<PathBuf>,
    #[arg(long, hide = true)]
    lesson: Option<PathBuf>,
    #[arg(long, hide = true)]
    synthetic: Option<u32>,
    #[arg(long, hide = true)]
    partners: Option<u32>,
    #[arg(long, hide = true)]
    stay: bool,
    #[arg(long, hide = true)]
    lockstep: bool,
    #[arg(long, hide = true)]
    state: Option<PathBuf>,
    #[arg(long, hide = true)]
    campaign: Option<PathBuf>,
}

impl LaunchArgs {
    pub(crate) fn in_domain(&self, domain: PathBuf, config: Option<PathBuf>) -> Launch {
        Launch {
            domain,
            incarnation: self.incarnation,
            parent: self.parent,
            config,
            kept: self.kept.clone(),
            lesson: self.lesson.clone(),
            synthetic: self.synthetic,
            partners: self.partners,
            stay: self.stay,
            lockstep: self.lockstep,
            state: self.state.clone(),
            campaign: self.campaign.clone(),
        }
    }
}
