//! The media types of bodies that are not JSON.

use schemars::{Schema, json_schema};

use super::operation::Content;

/// What kind of file a body is.
pub trait Media {
    /// Its name in the description.
    const NAME: &'static str;
    /// The header that an answer carries.
    const CONTENT_TYPE: &'static str = Self::NAME;

    /// What is in it.
    fn schema() -> Schema {
        json_schema!({"type": "string", "format": "binary"})
    }

    /// As a body is described.
    fn content() -> Content {
        Content { media_type: Self::NAME, schema: Self::schema(), example: None }
    }
}

/// A table as text.
#[derive(Clone, Copy, Debug)]
pub enum Csv {}

impl Media for Csv {
    const NAME: &'static str = "text/csv";
    const CONTENT_TYPE: &'static str = "text/csv; charset=utf-8";
}

/// Places on the Earth, as JSON (RFC 7946).
#[derive(Clone, Copy, Debug)]
pub enum GeoJson {}

impl Media for GeoJson {
    const NAME: &'static str = "application/geo+json";

    fn schema() -> Schema {
        json_schema!({"type": "object"})
    }
}

/// A track as GPX.
#[derive(Clone, Copy, Debug)]
pub enum Gpx {}

impl Media for Gpx {
    const NAME: &'static str = "application/gpx+xml";
}

/// A track as KML.
#[derive(Clone, Copy, Debug)]
pub enum Kml {}

impl Media for Kml {
    const NAME: &'static str = "application/vnd.google-earth.kml+xml";
}

/// Points as `LandXML`.
#[derive(Clone, Copy, Debug)]
pub enum LandXml {}

impl Media for LandXml {
    const NAME: &'static str = "application/xml";
    const CONTENT_TYPE: &'static str = "application/xml; charset=utf-8";
}

/// Bytes.
#[derive(Clone, Copy, Debug)]
pub enum Binary {}

impl Media for Binary {
    const NAME: &'static str = "application/octet-stream";
}

/// A picture of any kind.
#[derive(Clone, Copy, Debug)]
pub enum Image {}

impl Media for Image {
    const NAME: &'static str = "image/*";
}

/// A JPEG picture.
#[derive(Clone, Copy, Debug)]
pub enum Jpeg {}

impl Media for Jpeg {
    const NAME: &'static str = "image/jpeg";
}

/// A PNG picture.
#[derive(Clone, Copy, Debug)]
pub enum Png {}

impl Media for Png {
    const NAME: &'static str = "image/png";
}

/// A WebP picture.
#[derive(Clone, Copy, Debug)]
pub enum WebP {}

impl Media for WebP {
    const NAME: &'static str = "image/webp";
}

/// A few words.
#[derive(Clone, Copy, Debug)]
pub enum PlainText {}

impl Media for PlainText {
    const NAME: &'static str = "text/plain";
    const CONTENT_TYPE: &'static str = "text/plain; charset=utf-8";
}

/// Figures for Prometheus.
#[derive(Clone, Copy, Debug)]
pub enum Metrics {}

impl Media for Metrics {
    const NAME: &'static str = "text/plain";
    const CONTENT_TYPE: &'static str = "text/plain; version=0.0.4; charset=utf-8";
}
