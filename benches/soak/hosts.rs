//! Hosts on one machine: network namespaces joined by a bridge, which can be disconnected.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// Set in the process inside the separate network namespace.
const INSIDE: &str = "RAILHEAD_SOAK_INSIDE";

/// Address of this process and of the database on the bridge.
pub const HERE: &str = "10.77.0.1";

/// The way in which a host is disconnected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// All packets are dropped, in both directions.
    BlackHole,
    /// The link is down, so that sending fails at once.
    Cable,
    /// Packets from the host arrive. Packets to it do not.
    OneWay,
    /// Only packets to this port of other hosts are dropped.
    Port(u16),
}

/// Runs this program again in a separate network namespace, which is removed at its end, and returns `true`. Returns `false` inside that namespace.
pub fn moved_into_a_network_of_its_own() -> bool {
    if std::env::var_os(INSIDE).is_some() {
        run("ip", "link set lo up");
        run("ip", "link add br0 type bridge");
        run("ip", &format!("addr add {HERE}/24 dev br0"));
        run("ip", "link set br0 up");
        return false;
    }
    let mut unshare = Command::new("unshare");
    unshare.arg("--net");
    if !is_root() {
        unshare.args(["--user", "--map-root-user"]);
    }
    let program = std::env::current_exe().expect("this program");
    unshare.arg(program).args(std::env::args_os().skip(1));
    let ended = unshare.env(INSIDE, "1").status().expect("unshare");
    assert!(ended.success(), "ended with {ended}");
    true
}

fn is_root() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().any(|line| line.starts_with("Uid:\t0\t"))
}

fn run(program: &str, words: &str) {
    let done = Command::new(program).args(words.split(' ')).status();
    let done = done.unwrap_or_else(|error| panic!("{program} (Debian: iproute2): {error}"));
    assert!(done.success(), "{program} {words}");
}

/// A host with its own address.
pub struct Host {
    pub address: String,
    /// Keeps the namespace alive. It ends with its standard input, and so with this process.
    keeper: Child,
}

impl Host {
    /// Creates the host with this number, from 2 to 254.
    pub fn new(number: u8) -> Host {
        let keeper = Command::new("unshare")
            .args(["--net", "cat"])
            .stdin(Stdio::piped())
            .spawn()
            .expect("unshare");
        let (id, address) = (keeper.id(), format!("10.77.0.{number}"));
        let network = |id: &str| std::fs::read_link(format!("/proc/{id}/ns/net")).ok();
        let ours: Option<PathBuf> = network("self");
        while network(&id.to_string()).is_none_or(|theirs| Some(theirs) == ours) {
            std::thread::sleep(Duration::from_millis(5));
        }
        run(
            "ip",
            &format!("link add v{number} type veth peer name eth0 netns {id}"),
        );
        run("ip", &format!("link set v{number} master br0 up"));
        let host = Host { address, keeper };
        host.ip(&format!("addr add {}/24 dev eth0", host.address));
        host.ip("link set eth0 up");
        host.ip("link set lo up");
        host
    }

    /// Returns the command for a program on this host.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new("nsenter");
        let id = self.keeper.id().to_string();
        command.args(["-t", &id, "-n", "--", program]);
        command
    }

    fn ip(&self, words: &str) {
        let done = self.command("ip").args(words.split(' ')).status();
        assert!(done.is_ok_and(|done| done.success()), "ip {words}");
    }

    fn nft(&self, rules: &str) {
        let mut nft = self.command("nft");
        let mut nft = nft
            .args(["-f", "-"])
            .stdin(Stdio::piped())
            .spawn()
            .expect("nft (Debian: nftables)");
        let mut input = nft.stdin.take().expect("its input");
        input.write_all(rules.as_bytes()).expect("rules");
        drop(input);
        assert!(nft.wait().is_ok_and(|done| done.success()), "nft {rules}");
    }

    /// Disconnects the host.
    pub fn cut(&self, how: Cut) {
        let input = "chain i { type filter hook input priority 0; iif lo accept; drop; };";
        let output = "chain o { type filter hook output priority 0; oif lo accept; drop; };";
        match how {
            Cut::Cable => self.ip("link set eth0 down"),
            Cut::BlackHole => self.nft(&format!("table inet cut {{ {input} {output} }}")),
            Cut::OneWay => self.nft(&format!("table inet cut {{ {input} }}")),
            Cut::Port(port) => self.nft(&format!(
                "table inet cut {{ chain i {{ type filter hook input priority 0; tcp sport {port} drop; }}; \
                 chain o {{ type filter hook output priority 0; tcp dport {port} drop; }}; }}"
            )),
        }
    }

    /// Reconnects the host.
    pub fn heal(&self, how: Cut) {
        match how {
            Cut::Cable => self.ip("link set eth0 up"),
            _ => self.nft("delete table inet cut"),
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // The process may have ended already.
        let _ = self.keeper.kill();
        let _ = self.keeper.wait();
    }
}
