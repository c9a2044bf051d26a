//! `--tev`: the picture and its layers in tev while they are made. What tev is sent is left to `fechner::preview`.

use anyhow::Context;
use clap::Args;
use fechner::adaptive::judge::Judgement;
use fechner::adaptive::state::RenderState;
use fechner::poison::Unpoisoned as _;
use fechner::preview::{Looked, Shown, Stage, TEV_PORT, Tev};
use std::net::{IpAddr, SocketAddr, ToSocketAddrs};
use std::sync::{Arc, Mutex, MutexGuard};

/// Where tev listens.
#[derive(Clone, Debug, Args)]
pub(super) struct TevArguments {
    /// Send the picture and its layers to a running tev, about once a second; the port is tev's own if none is named.
    #[arg(long, value_name = "HOST:PORT", value_parser = parse_addresses, help_heading = "Running")]
    tev: Option<Addresses>,
}

#[derive(Clone, Debug)]
struct Addresses(Vec<SocketAddr>);

fn parse_addresses(text: &str) -> Result<Addresses, String> {
    let resolve = || match text.trim_matches(['[', ']']).parse::<IpAddr>() {
        Ok(ip) => Ok(vec![SocketAddr::new(ip, TEV_PORT)].into_iter()),
        Err(_) if text.contains(':') => text.to_socket_addrs(),
        Err(_) => (text, TEV_PORT).to_socket_addrs(),
    };
    match resolve() {
        Ok(found) => Ok(Addresses(found.collect())),
        Err(error) => {
            Err(format!("\"{text}\" is no address ({error}); expected HOST:PORT, such as localhost:{TEV_PORT}"))
        }
    }
}

impl TevArguments {
    /// The tev that is asked for; `scene` is what it lists.
    pub(super) fn open(&self, scene: &str) -> anyhow::Result<Option<Tev>> {
        let warn = |warning: &str| say!("warning: {warning}");
        let open = |Addresses(addresses): &Addresses| Tev::new(addresses.clone(), format!("fechner: {scene}"), warn);
        self.tev.as_ref().map(open).transpose().context("the thread for tev could not be started")
    }
}

/// A render whose states tev is shown.
pub(super) struct Showing {
    nits_per_unit: f64,
    inner: Mutex<Inner>,
}

struct Inner {
    tev: Tev,
    looked: Option<Looked>,
}

impl Showing {
    pub(super) fn new(tev: Tev, nits_per_unit: f64) -> Self {
        Self { nits_per_unit, inner: Mutex::new(Inner { tev, looked: None }) }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unpoisoned()
    }

    /// Keeps what a look saw. Called after each look.
    pub(super) fn judged(&self, judgement: &Judgement) {
        self.inner().looked = Some(Looked::of(judgement));
    }

    /// Shows the picture if it is time to. Called between batches.
    pub(super) fn between_batches(&self, state: &RenderState) {
        let mut inner = self.inner();
        if inner.tev.is_due() {
            self.show(&mut inner, state, Stage::UnderWay);
        }
    }

    /// Shows the picture as it is at the end, whatever ended it.
    pub(super) fn ended(&self, state: &RenderState) {
        self.show(&mut self.inner(), state, Stage::AtRest);
    }

    fn show(&self, inner: &mut Inner, state: &RenderState, stage: Stage) {
        let Inner { tev, looked } = inner;
        let (film, nits_per_unit) = (&state.film, self.nits_per_unit);
        let raw = || {
            let pixels = film.pixel_count();
            Arc::new((0..pixels).map(|pixel| film.rgb_cd_m2(pixel, nits_per_unit)).collect::<Vec<_>>())
        };
        // Denoised pictures are made by looks; between two the last one stays.
        let rgb_cd_m2 = looked.as_ref().and_then(|looked| looked.denoised.clone()).unwrap_or_else(raw);
        let looked = looked.as_ref();
        tev.offer(&Shown { film, rgb_cd_m2: &rgb_cd_m2, step: 1, looked, nits_per_unit, stage });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ports_may_be_left_out() {
        let own = |text: &str| parse_addresses(text).map(|found| found.0.iter().map(ToString::to_string).collect());
        for (text, address) in [
            ("127.0.0.1", "127.0.0.1:14158"),
            ("127.0.0.1:9", "127.0.0.1:9"),
            ("::1", "[::1]:14158"),
            ("[::1]", "[::1]:14158"),
            ("[::1]:9", "[::1]:9"),
        ] {
            assert_eq!(own(text), Ok(vec![address.to_owned()]), "{text}");
        }
    }
}
