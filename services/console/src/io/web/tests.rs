use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};

use clock::Duration;
use message::{TeacherAct, TeacherActKind};
use serde_json::Value;
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tungstenite::client::IntoClientRequest as _;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::{Message, WebSocket};

use super::*;
use crate::io::requester::Requester;
use crate::requests::PageRequest;

/// Time-out of these tests, generous for a loaded machine.
const LONG: Duration = Duration::from_secs(60);
/// Time-outs far beyond a test's duration, so that each test triggers only the one that it is about.
const ENDLESS: Timeouts = Timeouts { beat: HOUR, send: HOUR, request_head: HOUR, connection: HOUR };
const HOUR: Duration = Duration::from_secs(3600);

fn serving(timeouts: Timeouts) -> Serving {
    Serving {
        address: SocketAddr::from(([127, 0, 0, 1], 0)),
        port_required: false,
        before: ServerIdentity::default(),
        urdf: "<robot/>".to_owned(),
        first: 1,
        open: ReadWithoutToken::Nothing,
        domain: PathBuf::from("/dev/shm/leo-there-is-none"),
        moves_here: true,
        timeouts,
    }
}

fn served(timeouts: Timeouts) -> Web {
    Web::serve(serving(timeouts)).unwrap()
}

/// Host and port, and the token.
fn parts(web: &Web) -> (String, String) {
    let (host, token) = web.url.trim_start_matches("http://").split_once("/?token=").expect("there is one");
    (host.to_owned(), token.to_owned())
}

fn host(web: &Web) -> String {
    parts(web).0
}

/// A request with additional header lines.
fn request(web: &Web, line: &str, more: &str) -> String {
    format!("{line} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n{more}\r\n", host(web))
}

/// The same with the token.
fn known(web: &Web, line: &str) -> String {
    request(web, line, &format!("Authorization: Bearer {}\r\n", parts(web).1))
}

/// The whole response to a request.
fn got(web: &Web, request: &str) -> String {
    let mut stream = TcpStream::connect(host(web)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    answered(stream)
}

/// The cookie that the printed address sets, as a header line.
fn cookie(web: &Web) -> String {
    let page = got(web, &request(web, &format!("GET /?token={}", parts(web).1), ""));
    let line = page.lines().find_map(|line| line.strip_prefix("set-cookie: ")).expect("a cookie");
    format!("Cookie: {}\r\n", line.split(';').next().unwrap())
}

/// The head of a request that opens a page's WebSocket.
fn upgrade(host: &str, query: &str, more: &str) -> String {
    format!(
        "GET /live{query} HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{more}\r\n"
    )
}

fn opened(web: &Web) -> WebSocket<TcpStream> {
    let (host, token) = parts(web);
    opened_as(&host, &format!("?token={token}")).unwrap()
}

fn opened_as(host: &str, query: &str) -> Result<WebSocket<TcpStream>, String> {
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    let request = format!("ws://{host}/live{query}").into_client_request().unwrap();
    tungstenite::client(request, stream).map(|(socket, _)| socket).map_err(|error| error.to_string())
}

/// The next text message of a page.
fn heard(page: &mut WebSocket<TcpStream>) -> Value {
    loop {
        if let Message::Text(text) = page.read().unwrap() {
            return serde_json::from_str(&text).unwrap();
        }
    }
}

/// The close frame of a page.
fn farewell(page: &mut WebSocket<TcpStream>) -> (CloseCode, String) {
    loop {
        if let Message::Close(close) = page.read().unwrap() {
            let close = close.unwrap();
            return (close.code, close.reason.to_string());
        }
    }
}

/// The page that cancelled its act.
fn release(web: &Web) -> u16 {
    let asked = web.pending_requests.recv_timeout(LONG).expect("somebody lets go");
    let PageRequest::Act(act) = asked.page_request else { panic!("an act") };
    assert_eq!((act.kind(), asked.requester.id), (Some(TeacherActKind::Cancel), None));
    asked.page
}

/// Returns once `count` pages are open.
fn await_open(web: &Web, count: u64) {
    let end = clock::now() + LONG;
    while web.open() != count {
        assert!(clock::now() < end, "{} pages are open", web.open());
    }
}

/// The response on a connection until it is closed.
fn answered(mut stream: TcpStream) -> String {
    let mut said = Vec::new();
    stream.set_read_timeout(Some(LONG)).unwrap();
    match stream.read_to_end(&mut said) {
        // The server resets a connection whose request was not read completely.
        Err(error) if error.kind() == io::ErrorKind::ConnectionReset => {}
        read => drop(read.expect("it is shut")),
    }
    String::from_utf8_lossy(&said).into_owned()
}

#[test]
fn a_wildcard_address_is_reported_as_an_openable_one() {
    for (every, said) in [("0.0.0.0:0", "http://127.0.0.1:"), ("[::]:0", "http://[::1]:")] {
        let served = Web::serve(Serving { address: every.parse().unwrap(), ..serving(ENDLESS) });
        // Not every machine supports both IP versions.
        let Ok(web) = served else { continue };
        assert!(web.everywhere && web.url.starts_with(said) && web.url.contains("/?token="), "{}", web.url);
        TcpStream::connect(host(&web)).unwrap();
    }
    assert!(!served(ENDLESS).everywhere);
}

#[test]
fn without_the_token_every_address_refuses_and_counts() {
    for address in ["127.0.0.1:0", "0.0.0.0:0"] {
        let web = Web::serve(Serving { address: address.parse().unwrap(), ..serving(ENDLESS) }).unwrap();
        let (host, token) = parts(&web);
        let asked = |path: &str, query: &str| {
            let asks = match path {
                "/live" => upgrade(&host, query, ""),
                _ => request(&web, &format!("GET {path}{query}"), ""),
            };
            let mut stream = TcpStream::connect(&host).unwrap();
            stream.set_read_timeout(Some(LONG)).unwrap();
            stream.write_all(asks.as_bytes()).unwrap();
            let mut answer = [0; 12];
            stream.read_exact(&mut answer).unwrap();
            String::from_utf8_lossy(&answer).into_owned()
        };
        let mut refused = 0;
        for path in ["/", "/live", "/metrics", "/leo.urdf"] {
            let wrong = [
                "?token=".to_owned(),
                format!("?token={}", &token[1..]),
                format!("?token={token}0"),
                format!("?token={}", token.chars().rev().collect::<String>()),
                format!("?other={token}"),
            ];
            for query in std::iter::once(String::new()).chain(wrong) {
                assert_eq!(asked(path, &query), "HTTP/1.1 401", "{path}{query}");
                refused += 1;
                assert_eq!(web.refused(), refused, "{path}{query}");
            }
            let said = match path {
                "/live" => "HTTP/1.1 101",
                _ => "HTTP/1.1 200",
            };
            assert_eq!(asked(path, &format!("?token={token}")), said, "{path}");
            assert_eq!(web.refused(), refused, "{path}");
        }
        assert!(refused > 0);
    }
}

#[test]
fn the_printed_address_gives_the_page_and_a_cookie_without_the_token() {
    let web = served(ENDLESS);
    let (host, token) = parts(&web);
    let port = host.rsplit_once(':').unwrap().1;
    for from in ["none", "cross-site"] {
        let site = format!("Sec-Fetch-Site: {from}\r\n");
        let page = got(&web, &request(&web, &format!("GET /?a=b&token={token}&c=d"), &site));
        assert!(page.starts_with("HTTP/1.1 200"), "{page}");
        let cookie = page.lines().find(|line| line.starts_with("set-cookie: ")).unwrap();
        assert!(cookie.starts_with(&format!("set-cookie: leo_{port}=")), "{cookie}");
        assert!(cookie.ends_with("; Path=/; HttpOnly; SameSite=Strict"), "{cookie}");
        assert!(page.contains("cache-control: no-store\r\n") && !page.contains(&token), "{page}");
    }
    let page = got(&web, &request(&web, "GET /", &cookie(&web)));
    assert!(page.starts_with("HTTP/1.1 200") && !page.contains("set-cookie"), "{page}");
}

#[test]
fn the_cookie_alone_neither_reads_nor_commands() {
    let domain = tempfile::tempdir().unwrap();
    let serve =
        |open| Web::serve(Serving { domain: domain.path().to_owned(), open, ..serving(ENDLESS) }).unwrap();
    let web = serve(ReadWithoutToken::Nothing);
    let cookie_line = cookie(&web);
    let value = cookie_line.trim_end().split_once('=').unwrap().1;
    let bearer = format!("{cookie_line}Authorization: Bearer {value}\r\n");
    assert!(got(&web, &request(&web, "GET /page.js", &cookie_line)).starts_with("HTTP/1.1 200"));
    for more in [cookie_line.as_str(), &bearer] {
        for path in ["/metrics", "/leo.urdf"] {
            let answer = got(&web, &request(&web, &format!("GET {path}"), more));
            assert!(answer.starts_with("HTTP/1.1 401") && !answer.contains("<robot/>"), "{path}: {answer}");
        }
        for query in [String::new(), format!("?token={value}")] {
            let answer = got(&web, &upgrade(&host(&web), &query, more));
            assert!(answer.starts_with("HTTP/1.1 401"), "{query}: {answer}");
        }
    }
    assert_eq!((web.open(), web.refused()), (0, 8));
    let stopped = got(&web, &request(&web, "POST /stop", &cookie_line));
    assert!(stopped.starts_with("HTTP/1.1 200"), "{stopped}");

    // Where reading is open, the cookie reads no more than any client, and commands nothing.
    let web = serve(ReadWithoutToken::Page);
    let host = host(&web);
    let stream = TcpStream::connect(&host).unwrap();
    stream.set_read_timeout(Some(LONG)).unwrap();
    let mut request = format!("ws://{host}/live").into_client_request().unwrap();
    let value = cookie(&web).trim_end().strip_prefix("Cookie: ").unwrap().parse().unwrap();
    request.headers_mut().insert("cookie", value);
    let (mut reader, _) = tungstenite::client(request, stream).unwrap();
    assert_eq!(heard(&mut reader)["access"], "read");
    reader.send(Message::text(r#"{"do":"arm","id":5}"#)).unwrap();
    let answer = std::iter::repeat_with(|| heard(&mut reader)).find(|said| said["answer"] == 5).unwrap();
    assert!(answer["error"].as_str().unwrap().contains("`leo run` prints"), "{answer}");
    assert!(web.pending_requests.is_empty());
    // With the token, the same act is passed on to the robot.
    let mut page = opened(&web);
    page.send(Message::text(r#"{"do":"arm","id":6}"#)).unwrap();
    assert_eq!(web.pending_requests.recv_timeout(LONG).unwrap().requester.id, Some(6));
}

#[test]
fn without_the_token_a_notice_with_the_stop_button_is_shown() {
    let domain = tempfile::tempdir().unwrap();
    let web = Web::serve(Serving { domain: domain.path().to_owned(), ..serving(ENDLESS) }).unwrap();
    let page = got(&web, &request(&web, "GET /", "Accept: text/html\r\n"));
    assert!(page.starts_with("HTTP/1.1 401") && page.contains("content-type: text/html"), "{page}");
    for said in ["`leo run` prints", "page_token", r#"method="post" action="/stop""#] {
        assert!(page.contains(said), "{said}: {page}");
    }
    let text = got(&web, &request(&web, "GET /metrics", ""));
    assert!(text.contains("www-authenticate: Bearer") && !text.contains("<form"), "{text}");

    let origin = |origin: &str| format!("Origin: http://{origin}\r\n");
    for other in [origin("evil.example"), "Sec-Fetch-Site: cross-site\r\n".to_owned()] {
        let refused = got(&web, &request(&web, "POST /stop", &other));
        assert!(refused.starts_with("HTTP/1.1 403"), "{refused}");
    }
    assert!(got(&web, &request(&web, "GET /stop", "")).starts_with("HTTP/1.1 405"));
    assert!(!process::emergency::is_raised(domain.path()));
    let stopped = got(&web, &request(&web, "POST /stop", &origin(&host(&web))));
    assert!(stopped.starts_with("HTTP/1.1 200") && stopped.contains("is raised"), "{stopped}");
    let reason = process::emergency::reason(domain.path()).unwrap();
    assert!(reason.contains("127.0.0.1"), "{reason}");
    let again = got(&web, &request(&web, "POST /stop", ""));
    assert!(again.contains(&format!("({reason})")), "{again}");
    let body = |answer: &str| answer.split("\r\n\r\n").nth(1).unwrap().trim().to_owned();
    insta::assert_snapshot!(format!("{}\n{}", body(&stopped), body(&again)));
}

#[test]
fn a_failed_stop_is_reported_as_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    let stopped = |domain: PathBuf, moves_here| {
        let web = Web::serve(Serving { domain, moves_here, ..serving(ENDLESS) }).unwrap();
        got(&web, &request(&web, "POST /stop", ""))
    };
    for (said, why) in
        [(stopped(file, true), "file"), (stopped(folder.path().to_owned(), false), "another machine")]
    {
        assert!(
            said.starts_with("HTTP/1.1 503") && said.contains("NOT STOPPED") && said.contains(why),
            "{said}"
        );
    }
    assert!(!process::emergency::is_raised(folder.path()));
}

#[test]
fn without_the_token_a_page_only_reads_if_allowed() {
    let web = Web::serve(Serving { open: ReadWithoutToken::Page, ..serving(ENDLESS) }).unwrap();
    web.shared.state_store().put("cell", &1);
    let host = host(&web);
    let mut reader = opened_as(&host, "").unwrap();
    assert_eq!(heard(&mut reader)["access"], "read");
    assert_eq!(heard(&mut reader)["cells"]["cell"], 1);
    for page_request in
        [r#"{"do":"arm","id":5}"#, r#"{"do":"undo","id":6}"#, r#"{"do":"record","id":7,"on":true}"#]
    {
        reader.send(Message::text(page_request)).unwrap();
        let answer = heard(&mut reader);
        assert!(answer["error"].as_str().unwrap().contains("`leo run` prints"), "{answer}");
    }
    assert!(web.pending_requests.is_empty());
    // Read-only pages leave slots for those with the token.
    let readers: Vec<_> = (1..MAX_READERS).map(|_| opened_as(&host, "").unwrap()).collect();
    assert!(opened_as(&host, "").unwrap_err().contains("503"));
    let page = opened(&web);
    drop((readers, reader));
    await_open(&web, 1);
    drop((opened_as(&host, "").unwrap(), page));
}

/// A connection with an incomplete request, reopened whenever it is closed.
async fn half_open(to: SocketAddr, from: [u8; 4]) {
    loop {
        let socket = TcpSocket::new_v4().unwrap();
        socket.bind(SocketAddr::from((from, 0))).unwrap();
        let Ok(mut stream) = socket.connect(to).await else { continue };
        if stream.write_all(b"GET /metrics HTTP/1.1\r\nHo").await.is_ok() {
            // Returns when the server closes it.
            let _shut = stream.read(&mut [0; 64]).await;
        }
    }
}

/// Half-open connections from the addresses, until the runtime is dropped.
fn flood(to: &str, from: impl Iterator<Item = [u8; 4]>) -> tokio::runtime::Runtime {
    let to = to.parse().unwrap();
    let flood = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    for from in from {
        flood.spawn(half_open(to, from));
    }
    flood
}

#[test]
fn requests_are_answered_beside_450_half_open_connections() {
    // 250 exhausted the slots when all addresses shared them; 600 exceeds the limit of one address.
    for flooding in [250, 600] {
        let domain = tempfile::tempdir().unwrap();
        let domain = domain.path().to_owned();
        let web = Web::serve(Serving { domain, ..serving(Timeouts::default()) }).unwrap();
        let others = (0..200).map(|last| [127, 0, 1, last]);
        let flood = flood(&host(&web), std::iter::repeat_n([127, 0, 0, 1], flooding).chain(others));
        // Wait until each was closed and reopened.
        let end = clock::now() + LONG;
        while web.shared.connections.entered() < 2 * (u64::try_from(flooding).unwrap() + 200) {
            assert!(clock::now() < end, "the flood does not come about");
            thread::yield_now();
        }
        let timed = |request: &str, said: &str| {
            let began = clock::now();
            let answer = got(&web, request);
            let took = clock::now().since(began);
            assert!(
                answer.contains(said),
                "beside {flooding}: {answer} after {took:?}, {:?}",
                web.shared.connections.evicted()
            );
            took
        };
        let mut times: Vec<Duration> =
            (0..30).map(|_| timed(&known(&web, "GET /leo.urdf"), "<robot/>")).collect();
        times.sort_unstable();
        // A blocked server answers none before the half-open connections have expired.
        assert!(times[15] < Timeouts::default().request_head, "beside {flooding}: {times:?}");
        timed(&request(&web, "GET /", ""), "`leo run` prints");
        timed(&request(&web, "POST /stop", ""), "is raised");
        flood.shutdown_background();
    }
}

#[test]
fn an_idle_connection_times_out_and_takes_no_page_slot() {
    let web = served(Timeouts { request_head: Duration::from_millis(200), ..ENDLESS });
    let silent: Vec<_> = (0..100)
        .map(|number| {
            let mut stream = TcpStream::connect(host(&web)).unwrap();
            if number % 2 == 0 {
                stream.write_all(b"GET /leo.urdf HTTP/1.1\r\nHo").unwrap();
            }
            stream
        })
        .collect();
    assert!(got(&web, &known(&web, "GET /leo.urdf")).ends_with("<robot/>"));
    for stream in silent {
        let said = answered(stream);
        assert!(!said.contains("<robot/>"), "{said}");
    }
    assert_eq!(web.refused(), 0, "none had to make way");
}

#[test]
fn a_head_that_is_too_long_is_refused_before_it_is_read() {
    let web = served(ENDLESS);
    let long = request(&web, "GET /", &format!("Cookie: {}\r\n", "a".repeat(64 << 10)));
    let mut stream = TcpStream::connect(host(&web)).unwrap();
    let _sent_in_part = stream.write_all(long.as_bytes());
    let said = answered(stream);
    assert!(said.is_empty() || said.starts_with("HTTP/1.1 431"), "{said}");
    let many = request(&web, "GET /", &"a: b\r\n".repeat(100));
    assert!(got(&web, &many).starts_with("HTTP/1.1 431"));
}

#[test]
fn connections_time_out_but_an_authorised_page_stays() {
    let web = served(Timeouts { connection: Duration::from_millis(300), ..ENDLESS });
    let mut page = opened(&web);
    let mut asks = TcpStream::connect(host(&web)).unwrap();
    let (host, token) = parts(&web);
    write!(asks, "GET /leo.urdf?token={token} HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    let said = answered(asks);
    assert!(said.ends_with("<robot/>") && said.starts_with("HTTP/1.1 200"), "{said}");
    // The page was open before.
    page.send(Message::text("no message")).unwrap();
    while heard(&mut page).get("error").is_none() {}
    assert_eq!(web.open(), 1);
}

#[test]
fn a_page_that_answers_no_ping_is_closed_and_releases_its_hand() {
    let web = served(Timeouts { beat: Duration::from_millis(200), ..ENDLESS });
    // A machine without network goes silent and does not close its end.
    let silent = opened(&web);
    let mut there = opened(&web);
    let end = clock::now() + LONG;
    while web.pending_requests.is_empty() {
        assert!(clock::now() < end, "the silent page holds on");
        heard(&mut there);
    }
    assert_eq!(release(&web), 1);
    there.send(Message::text(r#"{"do":"undo","id":5}"#)).unwrap();
    let asked = web.pending_requests.recv_timeout(LONG).unwrap();
    assert_eq!((asked.page, asked.requester.id), (2, Some(5)));
    await_open(&web, 1);
    drop(silent);
}

#[test]
fn a_page_that_does_not_read_is_closed_and_releases_its_hand() {
    let web = served(Timeouts { send: Duration::from_millis(100), ..ENDLESS });
    // More than the socket buffers hold.
    web.shared.state_store().put("large", &"a".repeat(32 << 20));
    let page = opened(&web);
    release(&web);
    await_open(&web, 0);
    drop(page);
}

#[test]
fn a_page_gets_heartbeats_when_nothing_changes() {
    let web = served(Timeouts { beat: Duration::from_millis(50), ..ENDLESS });
    web.shared.state_store().put("cell", &1);
    let mut page = opened(&web);
    let cells = heard(&mut page);
    assert_eq!(cells["fresh"], true);
    for _ in 0..3 {
        let said = heard(&mut page);
        assert_eq!((&said["version"], &said["fresh"]), (&cells["version"], &Value::Bool(false)));
        assert_eq!(said["cells"].as_object().unwrap().len(), 0);
    }
}

#[test]
fn a_closed_page_releases_its_hand_even_if_the_queue_is_full() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    assert_eq!(heard(&mut page)["fresh"], true);
    let (answer, _unread) = tokio::sync::mpsc::channel(1);
    let page_request = || {
        let undo = TeacherAct::new(TeacherActKind::Undo, 1);
        let requester = Requester { page: answer.clone(), id: Some(1) };
        QueuedRequest { page: 9, page_request: PageRequest::Act(Box::new(undo)), requester }
    };
    while web.shared.ask(page_request()) {}
    drop(page);
    // The page closed while the loop was busy.
    await_open(&web, 0);
    for _ in 0..MAX_PENDING_REQUESTS {
        assert_eq!(web.pending_requests.recv_timeout(LONG).unwrap().page, 9);
    }
    assert_eq!(release(&web), 1);
}

#[test]
fn the_number_of_pages_is_bounded_under_concurrent_opens() {
    let web = served(ENDLESS);
    let (host, token) = parts(&web);
    let request = upgrade(&host, &format!("?token={token}"), "");
    let mut pages: Vec<TcpStream> = (0..80).map(|_| TcpStream::connect(&host).unwrap()).collect();
    for page in &mut pages {
        page.write_all(request.as_bytes()).unwrap();
    }
    let mut answers = [0; 2];
    for page in &mut pages {
        page.set_read_timeout(Some(LONG)).unwrap();
        let mut answer = [0; 12];
        page.read_exact(&mut answer).unwrap();
        match &answer {
            b"HTTP/1.1 101" => answers[0] += 1,
            b"HTTP/1.1 503" => answers[1] += 1,
            other => panic!("{}", String::from_utf8_lossy(other)),
        }
    }
    assert_eq!(answers, [32, 48]);
    drop(pages);
    await_open(&web, 0);
}

#[test]
fn an_oversized_message_is_counted_and_closes_the_page_with_a_reason() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    page.send(Message::text("a".repeat(4096))).unwrap();
    let answer =
        std::iter::repeat_with(|| heard(&mut page)).find(|said| said.get("answer").is_some()).unwrap();
    assert!(answer["error"].is_string(), "{answer}");
    assert_eq!(web.refused(), 1);
    page.send(Message::text("a".repeat(4097))).unwrap();
    let (code, why) = farewell(&mut page);
    assert!(code == CloseCode::Size && why.contains("4096"), "{code:?} {why}");
    insta::assert_snapshot!(why);
    assert_eq!(web.refused(), 2);
    release(&web);
}

#[test]
fn an_invalid_message_is_counted_and_reported_to_its_page() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    // A text frame that is not UTF-8, with a masking key of zero.
    page.get_mut().write_all(&[0x81, 0x81, 0, 0, 0, 0, 0xff]).unwrap();
    assert_eq!(farewell(&mut page).0, CloseCode::Invalid);
    assert_eq!(web.refused(), 1);
    let mut page = opened(&web);
    // An unknown opcode.
    page.get_mut().write_all(&[0x83, 0x80, 0, 0, 0, 0]).unwrap();
    assert_eq!(farewell(&mut page).0, CloseCode::Protocol);
    assert_eq!(web.refused(), 2);
}

#[test]
fn every_message_counts_and_a_flood_closes_the_page() {
    for message in [
        Message::text(r#"{"do":"undo","id":5}"#),
        Message::binary(vec![0; 8]),
        Message::Ping(Bytes::new()),
        Message::Pong(Bytes::new()),
    ] {
        let web = served(ENDLESS);
        let mut page = opened(&web);
        let said = (0..200_000).take_while(|_| page.send(message.clone()).is_ok()).count();
        assert!(said >= 600, "shut after {said}");
        let end = clock::now() + LONG;
        while web.pending_requests.try_iter().all(|asked| asked.requester.id.is_some()) {
            assert!(clock::now() < end, "{message:?} is taken without end");
        }
        assert!(web.refused() > 0);
        await_open(&web, 0);
    }
}

#[test]
fn an_excess_message_is_answered_by_number_and_ignored() {
    let web = served(ENDLESS);
    let mut page = opened(&web);
    for id in 0..300 {
        page.send(Message::text(format!(r#"{{"do":"undo","id":{id}}}"#))).unwrap();
    }
    let mut answers = std::iter::repeat_with(|| heard(&mut page)).filter(|said| said.get("answer").is_some());
    let refused = answers.next().unwrap();
    assert!(refused["error"].as_str().unwrap().contains("more than 60 messages"), "{refused}");
    // The page is rate-limited although the loop has not processed any request.
    assert!(refused["answer"].as_u64().unwrap() >= 60, "{refused}");
    assert!(web.pending_requests.try_iter().all(|asked| asked.requester.id != refused["answer"].as_u64()));
}

#[test]
fn a_port_in_use_is_replaced_by_the_next_or_refused() {
    // Two neighbouring ports that this test holds, and one after them that is free.
    let (first, _second, address) = (0..100)
        .find_map(|_| {
            let first = std::net::TcpListener::bind(("127.0.0.1", 0)).unwrap();
            let address = first.local_addr().unwrap();
            let second = std::net::TcpListener::bind(("127.0.0.1", address.port().checked_add(1)?)).ok()?;
            let third = std::net::TcpListener::bind(("127.0.0.1", address.port().checked_add(2)?)).ok()?;
            drop(third);
            Some((first, second, address))
        })
        .unwrap();
    let web = Web::serve(Serving { address, ..serving(ENDLESS) }).unwrap();
    let next = address.port() + 2;
    assert_eq!((web.server_identity.port, web.port_in_use), (Some(next), Some(address.port())));
    let required = || Serving { address, port_required: true, ..serving(ENDLESS) };
    let error = Web::serve(required()).err().unwrap().to_string();
    assert!(error.contains(&address.to_string()) && error.contains("console.port_required"), "{error}");
    let mut console = config::Robot::load(None).unwrap().leo.console;
    let text = format!("{address}");
    console.address = config::leo::PageAddress::try_from(text).unwrap();
    assert!(check_port(&console).is_ok(), "another port will do");
    console.port_required = true;
    assert_eq!(check_port(&console).unwrap_err().to_string(), error);
    drop(first);
    assert!(check_port(&console).is_ok());
    let web = Web::serve(required()).unwrap();
    assert_eq!((web.server_identity.port, web.port_in_use), (Some(address.port()), None));
}
