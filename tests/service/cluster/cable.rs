//! A way to a server that is cut, or swallows everything, when a test says so.

use std::net::SocketAddr;

use tokio::io::copy_bidirectional;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// What a way does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    Whole,
    Cut,
    Silent,
}

/// Passes connections on, closes them, or swallows what they send.
pub struct Cable {
    pub address: SocketAddr,
    way: watch::Sender<Way>,
}

impl Cable {
    /// A way to what listens on a port of this machine.
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
                    // For ever: what was swallowed for a while does not come back to life.
                    if *seen.borrow() == Way::Silent {
                        std::future::pending::<()>().await;
                    }
                });
            }
        });
        Cable { address, way }
    }

    /// Closes every connection, and new ones at once; or lets new ones pass again.
    pub fn set_whole(&self, whole: bool) {
        self.way
            .send_replace(if whole { Way::Whole } else { Way::Cut });
    }

    /// Neither passes anything on nor says so, for the connections that there are and for new ones.
    pub fn swallow(&self) {
        self.way.send_replace(Way::Silent);
    }
}
