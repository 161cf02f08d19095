use super::*;

fn access_policy(open: ReadWithoutToken) -> AccessPolicy {
    AccessPolicy { token: Token::new().unwrap(), port: 7780, open }
}

/// The access of a request with additional header fields.
fn asked(
    policy: &AccessPolicy,
    method: &Method,
    host: &str,
    path: &str,
    more: &[(&'static str, String)],
) -> Result<Access, AccessError> {
    let mut headers = HeaderMap::new();
    headers.insert(header::HOST, host.parse().unwrap());
    for (name, value) in more {
        headers.append(*name, value.parse().unwrap());
    }
    AccessRequest { method, headers: &headers, uri: &path.parse().unwrap() }.access(policy)
}

fn got(policy: &AccessPolicy, path: &str, more: &[(&'static str, String)]) -> Result<Access, AccessError> {
    asked(policy, &Method::GET, "127.0.0.1:7780", path, more)
}

/// The cookie of the page of the policy, as a header field.
fn cookie(policy: &AccessPolicy) -> (&'static str, String) {
    ("cookie", format!("leo_7780={}", policy.token.cookie()))
}

#[test]
fn the_token_comes_from_the_address_or_the_header_only() {
    let policy = access_policy(ReadWithoutToken::Nothing);
    let token = policy.token.as_str();
    for path in ["/", "/live", "/metrics", "/leo.urdf"] {
        assert_eq!(got(&policy, path, &[]), Err(AccessError::NoToken), "{path}");
        assert_eq!(got(&policy, &format!("{path}?token={token}"), &[]), Ok(Access::Command), "{path}");
        assert_eq!(
            got(&policy, &format!("{path}?token={token}0"), &[]),
            Err(AccessError::WrongToken),
            "{path}"
        );
        for (name, value, access) in [
            ("authorization", format!("Bearer {token}"), Ok(Access::Command)),
            ("authorization", format!("bearer {token}"), Ok(Access::Command)),
            ("authorization", format!("Bearer {}", &token[1..]), Err(AccessError::WrongToken)),
            ("authorization", format!("Basic {token}"), Err(AccessError::NoToken)),
            ("cookie", format!("leo_7780={token}"), Err(AccessError::NoToken)),
        ] {
            assert_eq!(got(&policy, path, &[(name, value.clone())]), access, "{path} {name}: {value}");
        }
    }
    assert_eq!(got(&policy, "/page.css", &[]), Ok(Access::Read));
    assert_ne!(token, Token::new().unwrap().as_str());
    assert_eq!(format!("{:?}", policy.token), "Token(..)");
}

#[test]
fn the_cookie_admits_only_to_the_files_of_the_page() {
    let policy = access_policy(ReadWithoutToken::Nothing);
    let value = policy.token.cookie();
    for path in ["/", "/page.js"] {
        for (cookie, access) in [
            (format!("a=b; leo_7780={value}; c=d"), Ok(Access::Read)),
            (format!("leo_7781={value}"), Err(AccessError::NoToken)),
            (format!("leo_7780={}", &value[1..]), Err(AccessError::NoToken)),
            ("leo_7780=".to_owned(), Err(AccessError::NoToken)),
        ] {
            assert_eq!(got(&policy, path, &[("cookie", cookie.clone())]), access, "{path} {cookie}");
        }
    }
    for path in ["/live", "/metrics", "/leo.urdf", "/other"] {
        assert_eq!(got(&policy, path, &[cookie(&policy)]), Err(AccessError::NoToken), "{path}");
        let as_token = format!("{path}?token={value}");
        assert_eq!(got(&policy, &as_token, &[cookie(&policy)]), Err(AccessError::WrongToken), "{path}");
    }
    // A proxy may serve the page under a public name: the stop button works there without the script.
    let stop = |more: &[_]| asked(&policy, &Method::POST, "leo.example", STOP, more);
    assert_eq!(stop(&[]), Err(AccessError::OtherHost));
    assert_eq!(stop(&[cookie(&policy)]), Ok(Access::Read));
}

#[test]
fn a_page_with_a_wrong_token_is_refused_where_reading_is_open() {
    let policy = access_policy(ReadWithoutToken::Page);
    assert_eq!(got(&policy, "/?token=0", &[cookie(&policy)]), Err(AccessError::WrongToken));
    // A page that stored an old token still reads.
    assert_eq!(got(&policy, "/live?token=0", &[cookie(&policy)]), Ok(Access::Read));
}

#[test]
fn only_configured_resources_are_readable_without_the_token() {
    for (open, without) in [
        (ReadWithoutToken::Nothing, &[][..]),
        (ReadWithoutToken::Metrics, &["/metrics"][..]),
        (ReadWithoutToken::Page, &["/metrics", "/", "/page.js", "/live", "/leo.urdf"][..]),
    ] {
        let policy = access_policy(open);
        for path in ["/metrics", "/", "/page.js", "/live", "/leo.urdf", "/other"] {
            let access = if without.contains(&path) { Ok(Access::Read) } else { Err(AccessError::NoToken) };
            assert_eq!(got(&policy, path, &[]), access, "{open:?} {path}");
        }
    }
}

#[test]
fn only_this_machines_own_pages_may_ask_without_the_token() {
    let policy = access_policy(ReadWithoutToken::Page);
    let origin = |origin: &str| ("origin", origin.to_owned());
    let live = |host, more: &[_]| asked(&policy, &Method::GET, host, "/live", more);
    for host in
        ["127.0.0.1:7780", "localhost:7780", "[::1]:7780", "localhost", "[::1]", "leo.local", "leo:80"]
    {
        assert_eq!(live(host, &[]), Ok(Access::Read), "{host}");
        assert_eq!(live(host, &[origin(&format!("http://{host}"))]), Ok(Access::Read), "{host}");
    }
    for host in ["evil.example:7780", "127.0.0.1.evil.example", ":7780", ""] {
        assert_eq!(live(host, &[]), Err(AccessError::OtherHost), "{host}");
    }
    for other in ["http://evil.example", "http://127.0.0.1:80", "null", ""] {
        assert_eq!(live("127.0.0.1:7780", &[origin(other)]), Err(AccessError::OtherOrigin), "{other}");
    }
}

#[test]
fn commands_from_pages_of_another_origin_are_refused_despite_the_cookie() {
    let policy = access_policy(ReadWithoutToken::Nothing);
    let site = |site: &str| ("sec-fetch-site", site.to_owned());
    let other = ("origin", "http://127.0.0.1:9999".to_owned());
    // Even a page that has the token is refused.
    let known = ("authorization", format!("Bearer {}", policy.token.as_str()));
    for (method, path) in [(Method::GET, "/live"), (Method::POST, STOP)] {
        let asked = |more: &[_]| asked(&policy, &method, "127.0.0.1:7780", path, more);
        for from in ["same-origin", "none"] {
            assert_eq!(asked(&[known.clone(), site(from)]), Ok(Access::Command), "{path} {from}");
        }
        for has in [known.clone(), cookie(&policy)] {
            for from in ["cross-site", "same-site"] {
                assert_eq!(asked(&[has.clone(), site(from)]), Err(AccessError::OtherOrigin), "{path} {from}");
            }
            assert_eq!(asked(&[has, other.clone()]), Err(AccessError::OtherOrigin), "{path}");
        }
    }
}

#[test]
fn every_client_may_stop_the_robot_except_pages_of_another_origin() {
    let policy = access_policy(ReadWithoutToken::Nothing);
    let stop = |host, more: &[_]| asked(&policy, &Method::POST, host, "/stop", more);
    let origin = |origin: &str| ("origin", origin.to_owned());
    assert_eq!(stop("127.0.0.1:7780", &[]), Ok(Access::Read));
    assert_eq!(stop("127.0.0.1:7780", &[origin("http://127.0.0.1:7780")]), Ok(Access::Read));
    assert_eq!(stop("127.0.0.1:7780", &[origin("http://evil.example")]), Err(AccessError::OtherOrigin));
    assert_eq!(stop("127.0.0.1:7780", &[origin("null")]), Err(AccessError::OtherOrigin));
    assert_eq!(stop("evil.example", &[origin("http://evil.example")]), Err(AccessError::OtherHost));
}

#[test]
fn host_names_are_equal_despite_case_final_dot_and_default_port() {
    let policy = access_policy(ReadWithoutToken::Page);
    let live = |host: &str, origin: &str| {
        asked(&policy, &Method::GET, host, "/live", &[("origin", origin.to_owned())])
    };
    for (host, origin) in [
        ("LOCALHOST:7780", "http://localhost:7780"),
        ("localhost:7780", "http://LocalHost:7780"),
        ("LOCALHOST:7780", "HTTP://LOCALHOST:7780"),
        ("localhost.:7780", "http://localhost:7780"),
        ("Leo.LOCAL.", "http://leo.local"),
        ("leo.local:80", "http://leo.local"),
        ("leo.local", "http://leo.local:80"),
        ("leo.local:443", "https://leo.local"),
        ("leo.local", "https://leo.local:443"),
        ("leo.local:", "http://leo.local"),
        ("[::1]:80", "http://[::1]"),
        ("[FE80::1]", "http://[fe80::1]"),
    ] {
        assert_eq!(live(host, origin), Ok(Access::Read), "{host} {origin}");
    }
    for (host, origin) in [
        ("localhost:7780", "http://localhost"),
        ("localhost", "https://localhost:80"),
        ("localhost:80", "https://localhost"),
        ("leo.local", "http://leo.local.example"),
        ("localhost:7780", "http://localhost:7781"),
        ("localhost:7780", "localhost:7780"),
    ] {
        assert_eq!(live(host, origin), Err(AccessError::OtherOrigin), "{host} {origin}");
    }
    for host in
        ["EVIL.EXAMPLE", "evil.example.", "evil.local.example", ".", ".:80", "localhost:x", "localhost:99999"]
    {
        assert_eq!(live(host, &format!("http://{host}")), Err(AccessError::OtherHost), "{host}");
    }
}
