//! A TCP proxy that tests can disconnect or make silent.

use std::net::SocketAddr;

use tokio::io::copy_bidirectional;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// The state of a proxy.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Whole,
    Cut,
    Silent,
}

/// A TCP proxy that forwards connections, closes them, or discards what they send.
pub struct Cable {
    pub address: SocketAddr,
    way: watch::Sender<Way>,
}

impl Cable {
    /// Starts a proxy for a port of this machine.
    pub async fn to(port: u16) -> Cable {
        let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
        let address = listener.local_addr().expect("an address");
        let (way, seen) = watch::channel(Way::Whole);
        tokio::spawn(async move {
            while let Ok((mut near, _)) = listener.accept().await {
                let mut seen = seen.clone();
                tokio::spawn(async move {
                    if *seen.borrow_and_update() == Way::Cut {
                        return;
                    }
                    let Ok(mut far) = TcpStream::connect(("127.0.0.1", port)).await else {
                        return;
                    };
                    tokio::select! {
                        biased;
                        _ = seen.wait_for(|way| *way != Way::Whole) => {}
                        _ = copy_bidirectional(&mut near, &mut far) => return,
                    }
                    // The connection stays silent for ever: discarded data are not forwarded later.
                    if *seen.borrow() == Way::Silent {
                        std::future::pending::<()>().await;
                    }
                });
            }
        });
        Cable { address, way }
    }

    /// Closes all connections and rejects new ones if `whole` is false. Otherwise accepts new ones again.
    pub fn set_whole(&self, whole: bool) {
        self.way
            .send_replace(if whole { Way::Whole } else { Way::Cut });
    }

    /// Discards all data of existing and new connections without closing them.
    pub fn swallow(&self) {
        self.way.send_replace(Way::Silent);
    }
}
