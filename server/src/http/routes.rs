//! How a route is declared: a method, a path, the right that it asks for, its handler; then its name and what it is about.
//! There is no way to add a route without saying who may ask for it, and none to add one whose handler does not tell by
//! its types what it takes and gives.

use std::collections::HashMap;

use axum::Router;
use axum::http::{Method, StatusCode};
use axum::routing::{MethodFilter, on};

use super::operation::{Describe, Operation};
use super::request::ReadsQuery;
use super::schemas::Schemas;
use crate::rights::Right;
use crate::state::App;

/// What a route asks of its caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// A right.
    Right(Right),
    /// A right that may be shown in the first message of a websocket instead of its headers.
    Socket(Right),
    /// To write the session that the path names: `/sessions/{id}…`.
    OwnSession,
    /// To write the session of the log that the path names: `/logs/{id}…`.
    OwnLog,
    /// To have reported the fault that the path names, to be the one who sees to it, or to write everybody's: `/faults/{id}…`.
    OwnFault,
    /// The same, without being the one who sees to it: what is done cannot be undone.
    ReportedFault,
    /// To have made the mapping that the path names, or to write everybody's: `/mappings/{id}`.
    OwnMapping,
    /// A right, by somebody who has signed in: a token does not change accounts, sign-ins or tokens.
    SignedIn(Right),
}

impl Needs {
    /// The problems of a path that names nothing, or what is not the caller's. That a right is missing, any route may say.
    pub fn problems(self) -> &'static [(StatusCode, &'static str)] {
        const OF_A_SESSION: [(StatusCode, &str); 4] = [
            (StatusCode::NOT_FOUND, "not_an_id"),
            (StatusCode::NOT_FOUND, "session_not_found"),
            (StatusCode::FORBIDDEN, "not_your_walk"),
            (StatusCode::NOT_FOUND, "log_not_found"),
        ];
        const OF_A_FAULT: [(StatusCode, &str); 3] = [
            (StatusCode::NOT_FOUND, "not_an_id"),
            (StatusCode::NOT_FOUND, "fault_not_found"),
            (StatusCode::FORBIDDEN, "not_yours"),
        ];
        const OF_A_MAPPING: [(StatusCode, &str); 3] = [
            (StatusCode::NOT_FOUND, "not_an_id"),
            (StatusCode::NOT_FOUND, "mapping_not_found"),
            (StatusCode::FORBIDDEN, "not_yours"),
        ];
        match self {
            Needs::Right(_) | Needs::Socket(_) => &[],
            Needs::OwnSession => &OF_A_SESSION[..3],
            Needs::OwnLog => &OF_A_SESSION,
            Needs::OwnFault | Needs::ReportedFault => &OF_A_FAULT,
            Needs::OwnMapping => &OF_A_MAPPING,
            Needs::SignedIn(_) => &[(StatusCode::FORBIDDEN, "not_by_token")],
        }
    }
}

impl From<Right> for Needs {
    fn from(right: Right) -> Needs {
        Needs::Right(right)
    }
}

/// Routes with what they ask for.
#[derive(Debug, Default)]
pub struct Routes {
    router: Router<App>,
    declared: Vec<Declared>,
}

/// One route, as it was declared.
#[derive(Clone, Debug)]
pub struct Declared {
    /// The method; a route of GET answers HEAD, too.
    pub method: Method,
    /// The path with its variable parts, such as `/api/v1/markers/{name}`.
    pub path: String,
    /// What it asks of its caller.
    pub needs: Needs,
    /// Its name in the description, a verb and a noun: clients are made from it.
    pub id: &'static str,
    /// What it is about, in a line.
    pub about: &'static str,
    /// Tells what its handler takes and gives.
    pub describe: Describe,
}

impl Declared {
    /// The problems that its types and its right tell, each with its status.
    pub fn problems(&self) -> Vec<(StatusCode, &'static str)> {
        let mut told = (self.describe)(&mut Schemas::new()).problems;
        told.extend(self.needs.problems());
        told
    }

    /// Reads a query of it, where it takes one.
    pub fn query_reader(&self) -> Option<ReadsQuery> {
        (self.describe)(&mut Schemas::new()).query.map(|query| query.reads)
    }
}

impl Routes {
    /// None yet.
    pub fn new() -> Routes {
        Routes::default()
    }

    /// A route that shows something.
    pub fn get<H, P>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Operation<P>,
        P: 'static,
    {
        self.on(Method::GET, path, needs, handler)
    }

    /// A route that adds something, or does something.
    pub fn post<H, P>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Operation<P>,
        P: 'static,
    {
        self.on(Method::POST, path, needs, handler)
    }

    /// A route that makes something so.
    pub fn put<H, P>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Operation<P>,
        P: 'static,
    {
        self.on(Method::PUT, path, needs, handler)
    }

    /// A route that changes something.
    pub fn patch<H, P>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Operation<P>,
        P: 'static,
    {
        self.on(Method::PATCH, path, needs, handler)
    }

    /// A route that removes something.
    pub fn delete<H, P>(self, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Operation<P>,
        P: 'static,
    {
        self.on(Method::DELETE, path, needs, handler)
    }

    fn on<H, P>(mut self, method: Method, path: &str, needs: impl Into<Needs>, handler: H) -> Routes
    where
        H: Operation<P>,
        P: 'static,
    {
        let filter = MethodFilter::try_from(method.clone()).expect("the methods here have a filter");
        self.declared.push(Declared {
            method,
            path: path.to_owned(),
            needs: needs.into(),
            id: "",
            about: "",
            describe: H::signature,
        });
        Routes { router: self.router.route(path, on(filter, handler)), declared: self.declared }
    }

    /// The name of the route before, a verb and a noun, and what it is about, in a line.
    pub fn about(mut self, id: &'static str, about: &'static str) -> Routes {
        let last = self.declared.last_mut().expect("what is said is said of a route before");
        (last.id, last.about) = (id, about);
        self
    }

    /// These and others.
    pub fn merge(mut self, other: Routes) -> Routes {
        self.declared.extend(other.declared);
        Routes { router: self.router.merge(other.router), declared: self.declared }
    }

    /// These below a path.
    pub fn below(mut self, path: &str) -> Routes {
        for declared in &mut self.declared {
            declared.path.insert_str(0, path);
        }
        Routes { router: Router::new().nest(path, self.router), declared: self.declared }
    }

    /// These with something done to their router, such as a layer.
    pub fn with(self, change: impl FnOnce(Router<App>) -> Router<App>) -> Routes {
        Routes { router: change(self.router), declared: self.declared }
    }

    /// What answers.
    pub fn into_router(self) -> Router<App> {
        self.router
    }

    /// What was declared.
    pub fn declared(&self) -> &[Declared] {
        &self.declared
    }
}

/// What each route asks for, to be looked up.
#[derive(Debug)]
pub struct Table {
    by_path: HashMap<String, Vec<(Method, Needs)>>,
}

impl Table {
    /// Of these routes.
    pub fn of(declared: &[Declared]) -> Table {
        let mut by_path: HashMap<String, Vec<(Method, Needs)>> = HashMap::new();
        for Declared { method, path, needs, .. } in declared {
            by_path.entry(path.clone()).or_default().push((method.clone(), *needs));
        }
        Table { by_path }
    }

    /// What a route asks for; `None` where there is no such route.
    pub fn needs(&self, method: &Method, path: &str) -> Option<Needs> {
        self.by_path.get(path)?.iter().find(|(known, _)| known == method).map(|(_, needs)| *needs)
    }

    /// Whether a path is declared with any method.
    pub fn has(&self, path: &str) -> bool {
        self.by_path.contains_key(path)
    }
}
