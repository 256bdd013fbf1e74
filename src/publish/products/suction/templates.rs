//! Templates of the page of suction.

use crate::templates::PageTemplates;

/// Name of the template of the page.
pub(crate) const PAGE_TEMPLATE: &str = "suction.html";

/// The page, with what all pages share.
pub(crate) static TEMPLATES: PageTemplates = PageTemplates::new(&[(PAGE_TEMPLATE, include_str!("page.html"))]);
