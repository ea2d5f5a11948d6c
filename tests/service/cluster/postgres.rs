//! A PostgreSQL server shared by all tests that need one. It is found in the usual folders, keeps its data in a temporary folder, and ends with
//! this process. `RAILHEAD_TEST_POSTGRES` can name the URL of another server instead, with a role that may create databases.

use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

use railhead::jobs::store::postgres::schema::migrate;
use sqlx::{Connection, PgConnection};

use crate::support::skip;

/// The maximal time for the start of a server.
const STARTS_WITHIN: Duration = Duration::from_secs(60);

/// An additional address to listen on, whose /24 network is trusted. It must be set before the server starts.
#[allow(dead_code, reason = "for benches")]
pub static ALSO_AT: OnceLock<&'static str> = OnceLock::new();

struct Server {
    /// URL for connections without TLS, which most tests use.
    url: String,
    /// Certificate of the authority that signed the server's certificate for `localhost`.
    authority: Option<PathBuf>,
    /// Folder of the data, if this process started the server.
    folder: Option<PathBuf>,
    /// A shell that ends the server when its standard input closes, however this process ends.
    _shell: Option<Child>,
}

/// Returns the URL of the server, or `None` after reporting that PostgreSQL is not installed.
pub fn server() -> Option<&'static str> {
    Some(the_server()?.url.as_str())
}

fn the_server() -> Option<&'static Server> {
    static SERVER: OnceLock<Option<Server>> = OnceLock::new();
    let server = SERVER.get_or_init(|| match std::env::var("RAILHEAD_TEST_POSTGRES") {
        Ok(url) => Some(Server {
            url,
            authority: None,
            folder: None,
            _shell: None,
        }),
        Err(_) => start(),
    });
    if server.is_none() {
        skip("there is no PostgreSQL here (Debian: apt-get install postgresql)");
    }
    server.as_ref()
}

/// Returns the port of a server that supports TLS as `localhost`, and the file with the certificate of its authority.
pub fn encrypted() -> Option<(&'static str, &'static Path)> {
    let server = the_server()?;
    let Some(authority) = &server.authority else {
        skip("the certificate of the PostgreSQL that RAILHEAD_TEST_POSTGRES names is not known");
        return None;
    };
    let (_, port) = server.url.rsplit_once(':')?;
    Some((port.split('/').next()?, authority))
}

/// Returns a function that replaces the port of a URL, and the present port.
pub fn at_port(url: &str) -> (impl Fn(u16) -> String, u16) {
    let (front, rest) = url.rsplit_once(':').expect("a URL with a port");
    let (port, rest) = rest.split_once('/').expect("a URL with a database");
    let number = port.parse().expect("a number");
    let (front, rest) = (front.to_owned(), rest.to_owned());
    (move |port| format!("{front}:{port}/{rest}"), number)
}

/// Ends the server abruptly, as `pg_ctl -m immediate` does; it is restarted at once. Tests must not call this, because they share the server.
#[allow(dead_code, reason = "for benches")]
pub fn crash() {
    let server = the_server().expect("a server");
    let folder = server.folder.as_ref().expect("a server of our own");
    let noted = std::fs::read_to_string(folder.join("db/postmaster.pid")).expect("its number");
    let number = noted.lines().next().expect("a line");
    let ended = Command::new("kill").args(["-QUIT", number]).status();
    assert!(ended.is_ok_and(|status| status.success()));
}

/// Returns the log of the server so far, or `None` after reporting that another process started it.
#[allow(dead_code, reason = "not for every program that has this file")]
pub fn log_lines() -> Option<Vec<String>> {
    let Some(folder) = &the_server()?.folder else {
        skip("the log of the PostgreSQL that RAILHEAD_TEST_POSTGRES names cannot be read");
        return None;
    };
    let text = std::fs::read(folder.join("log")).expect("its log");
    let text = String::from_utf8_lossy(&text);
    Some(text.lines().map(str::to_owned).collect())
}

/// Returns a URL with one more parameter.
pub fn with_parameter(url: &str, parameter: &str) -> String {
    let mark = if url.contains('?') { '&' } else { '?' };
    format!("{url}{mark}{parameter}")
}

/// Creates a `DATABASE` or a `SCHEMA` on that server. Returns the URL of the server and the new name.
async fn make(what: &str) -> Option<(&'static str, String)> {
    static MADE: AtomicU32 = AtomicU32::new(0);
    let url = server()?;
    let number = MADE.fetch_add(1, Ordering::Relaxed);
    let name = format!("test_{}_{number}", std::process::id());
    let mut server = PgConnection::connect(url).await.expect("the server");
    let statement = sqlx::AssertSqlSafe(format!("CREATE {what} {name}"));
    let made = sqlx::query(statement).execute(&mut server).await;
    made.unwrap_or_else(|error| panic!("{what}: {error}"));
    Some((url, name))
}

/// Creates a database on the server. Returns its URL.
pub async fn database() -> Option<String> {
    let (url, name) = make("DATABASE").await?;
    let (address, query) = url.split_once('?').unwrap_or((url, ""));
    let (front, _) = address.rsplit_once('/').expect("a URL with a database");
    Some(format!("{front}/{name}?{query}"))
}

/// Creates a schema with the tables of the service, which is faster than creating a database. Returns its URL.
pub async fn schema() -> Option<String> {
    let (url, name) = make("SCHEMA").await?;
    let url = with_parameter(url, &format!("options=-c%20search_path%3D{name}"));
    migrate(&url).await.expect("tables");
    Some(url)
}

/// Returns the folder of the server programs.
fn programs() -> Option<PathBuf> {
    let there = |folder: &PathBuf| folder.join("initdb").is_file();
    let mut folders: Vec<PathBuf> = std::fs::read_dir("/usr/lib/postgresql")
        .into_iter()
        .flatten()
        .filter_map(|version| Some(version.ok()?.path().join("bin")))
        .collect();
    folders.sort();
    folders.reverse();
    let path = std::env::var_os("PATH").unwrap_or_default();
    folders.extend(std::env::split_paths(&path));
    folders.into_iter().find(there)
}

/// Returns a shell with a user that may run the server, which refuses root. If PostgreSQL was installed as a package, its user exists. In a
/// namespace whose only user is root, root is mapped to another user id.
pub fn shell(folder: &Path) -> Command {
    let read = |file: &str| std::fs::read_to_string(file).unwrap_or_default();
    let root = read("/proc/self/status")
        .lines()
        .any(|line| line.starts_with("Uid:\t0\t"));
    if !root {
        return Command::new("sh");
    }
    let alone = read("/proc/self/uid_map").split_whitespace().nth(2) == Some("1");
    if alone {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-user=65534", "--map-group=65534", "sh"]);
        return command;
    }
    let users = read("/etc/passwd");
    let entry = |name: &str| users.lines().find(|line| line.starts_with(name));
    let user = entry("postgres:").or_else(|| entry("nobody:"));
    let mut numbers = user
        .expect("a user that is not root")
        .split(':')
        .skip(2)
        .map(|number| number.parse().expect("a number"));
    let (uid, gid) = (numbers.next(), numbers.next());
    std::os::unix::fs::chown(folder, uid, gid).expect("the folder changes hands");
    let mut command = Command::new("sh");
    command.uid(uid.expect("uid")).gid(gid.expect("gid"));
    command
}

/// Writes a certificate for `localhost` with its key, and the certificate of its authority. Returns the path of the latter.
fn certify(folder: &Path) -> PathBuf {
    use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, IsCa, KeyPair};
    let mut authority = CertificateParams::new(Vec::new()).expect("no names");
    authority.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
    let authority = CertifiedIssuer::self_signed(authority, KeyPair::generate().expect("a key"))
        .expect("an authority");
    let key = KeyPair::generate().expect("a key");
    let server = CertificateParams::new(vec!["localhost".to_owned()]).expect("a name");
    let server = server.signed_by(&key, &authority).expect("a certificate");
    let write = |name: &str, text: String| {
        let path = folder.join(name);
        std::fs::write(&path, text).expect("a file");
        path
    };
    write("server.pem", server.pem());
    write("server.key", key.serialize_pem());
    write("authority.pem", authority.pem())
}

/// Creates a temporary folder that the program under test removes.
pub fn left_folder(name: &str) -> PathBuf {
    let mut folder = tempfile::Builder::new();
    folder.prefix(name).tempdir().expect("a folder").keep()
}

/// Returns a port that is free at this moment.
pub fn free_port() -> u16 {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    listener.local_addr().expect("an address").port()
}

/// Starts a process from a shell in its folder and waits until it is ready. The process ends when the standard input of the shell closes, however
/// this process ends.
pub fn started(mut shell: Command, script: &str, ready: impl Fn() -> bool) -> Child {
    let shell = shell.args(["-c", script]).stdin(Stdio::piped());
    let child = shell.spawn().expect("a shell");
    let until = Instant::now() + STARTS_WITHIN;
    while !ready() {
        assert!(Instant::now() < until, "not ready: {script}");
        std::thread::sleep(Duration::from_millis(50));
    }
    child
}

fn start() -> Option<Server> {
    let programs = programs()?;
    let (folder, port) = (left_folder("railhead-pg"), free_port());
    let authority = certify(&folder);
    let (more, trusted) = match ALSO_AT.get() {
        Some(address) => (
            format!(",{address}"),
            format!("echo host all all {address}/24 trust >> db/pg_hba.conf && "),
        ),
        None => Default::default(),
    };
    // The server rejects keys that other users may read. The script ends when its standard input closes, and removes its data.
    let script = format!(
        "cd '{data}' && mkdir tls && cp server.pem server.key tls && chmod 600 tls/server.key && '{bin}/initdb' -D db -U railhead -A trust -E UTF8 --no-locale -N > init.log 2>&1 && {trusted}\
         {{ while [ ! -e stop ]; do '{bin}/postgres' -D db -k '{data}' -c listen_addresses=127.0.0.1{more} -p {port} -c fsync=off \
         -c ssl=on -c ssl_cert_file='{data}/tls/server.pem' -c ssl_key_file='{data}/tls/server.key' -c max_connections=400 -c shared_buffers=64MB -c deadlock_timeout=200ms; done > log 2>&1 & }} && \
         read nothing; touch stop; while kill -0 $!; do kill -QUIT $(head -n 1 db/postmaster.pid); sleep 0.1; done 2> /dev/null; \
         wait; rm -rf '{data}'",
        data = folder.display(),
        bin = programs.display(),
    );
    let ready = || {
        let mut asked = Command::new(programs.join("pg_isready"));
        asked.args(["-q", "-h", "127.0.0.1", "-p", &port.to_string()]);
        asked.status().is_ok_and(|status| status.success())
    };
    let child = started(shell(&folder), &script, ready);
    let url = format!("postgres://railhead@127.0.0.1:{port}/postgres?sslmode=disable");
    Some(Server {
        url,
        authority: Some(authority),
        folder: Some(folder),
        _shell: Some(child),
    })
}
