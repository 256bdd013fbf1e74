//! Templates of the page of grasps.

use crate::templates::PageTemplates;

/// Name of the template of the page.
pub(crate) const PAGE_TEMPLATE: &str = "grasps.html";

/// The page and the part about trials, with what all pages share.
pub(crate) static TEMPLATES: PageTemplates =
    PageTemplates::new(&[(PAGE_TEMPLATE, include_str!("page.html")), ("trials.html", include_str!("trials.html"))]);
