//! The explanation page of every code: why it is a mistake, one example that is wrong and one that is right. The tests
//! check each example, and that every code that a room may give has its page.

macro_rules! pages {
    ($($code:literal)*) => { &[$(($code, include_str!(concat!("pages/", $code, ".md")))),*] };
}

/// Codes in order, each with its page.
static PAGES: &[(&str, &str)] = pages! {
    "E0001" "E0002" "E0003" "E0006" "E0007" "E0008" "E0009" "E0010" "E0100" "E0101" "E0102" "E0103" "E0104"
    "E0105" "E0106" "E0107" "E0108" "E0109" "E0110" "E0111" "E0112" "E0113" "E0114" "E0115" "E0116" "E0117"
    "E0118" "E0119" "E0120" "E0121" "E0122" "E0123" "E0124" "E0125" "E0126" "E0127" "E0129" "E0130" "E0131"
    "E0132" "E0133" "E0134" "E0201" "E0203" "E0204" "E0205" "E0206" "E0207" "E0208" "E0210" "E0301" "E0302"
    "E0303" "E0304" "E0305" "E0306" "E0307" "E0308" "E0309" "E0310" "E0311" "E0312" "E0314" "E0315" "E0316"
    "E0317" "E0318" "E0319" "E0320" "E0321" "E0322" "E0323" "E0324" "E0325" "E0326" "E0327" "E0328" "E0329"
    "E0330" "E0331" "E0332" "E0333" "E0334" "E0340" "E0401" "E0402" "E0403" "E0404" "E0405" "E0406" "E0407"
    "E0409" "E0410" "E0411" "E0412" "E0414" "E0415" "E0416" "E0417" "E0499" "E0501" "E0502" "E0503" "E0504"
    "E0505" "E0506" "E0507" "E0508" "E0509" "E0510" "E0511" "E0512" "E0513" "E0514" "E0515" "E0516" "E0517"
    "E0518" "E0520" "E0601" "E0602" "E0603" "E0604" "E0605" "E0606" "E0607" "E0608" "E0620" "E0621" "E0701"
    "E0702" "E0703" "E0704" "E0705" "E0706" "E0707" "E0708" "E0709" "E0710" "E0711" "E0712" "E0713" "E0714"
    "E0715" "E0719" "E0721" "E0722" "E0723" "E0724" "E0725" "E0726" "E0727" "E0728" "E0729" "E0730" "E0731"
    "E0732" "E0740" "E0741" "E0742" "E0743" "E0744" "E0745" "E0746" "E0747" "E0748" "E0749" "E0750" "E0751"
    "E0752" "E0753" "E0754" "E0755" "E0756" "E0757" "E0758" "E0761" "E0762" "E0764" "E0766" "E0770" "E0771"
    "E0772" "E0773" "E0774" "E0775" "E0801" "E0802" "E0803" "E0804" "E0805" "E0806" "E0807" "E0808" "E0809"
    "E0810" "E0811" "E0812" "E0814" "E0815" "E0816" "E0817" "E0830" "E0831" "E0832" "E0834" "E0850" "E0851"
    "E0852" "E0854" "E0855" "E0856" "E0857" "E0858" "E0859" "E0861" "E0862" "E0901" "E0902" "E0903" "E0905"
    "E0950" "E0951" "E0952" "E0953" "E0954" "W0101" "W0210" "W0211" "W0327" "W0450" "W0451" "W0620" "W0716"
    "W0717" "W0718" "W0720" "W0760" "W0763" "W0765" "W0813" "W0833" "W0904" "W0906" "W0907" "W0908"
};

/// The page of a code, in Markdown. The code is taken as people write it: `E0312`, `e0312`, `0312`, `312`.
pub fn page(code: &str) -> Option<&'static str> {
    let code = tidy(code);
    let at = PAGES.binary_search_by(|(known, _)| (*known).cmp(code.as_str())).ok();
    let warning = || {
        let digits = code.strip_prefix('E').filter(|_| code.len() == 5)?;
        PAGES.iter().position(|(known, _)| known.strip_prefix('W') == Some(digits))
    };
    at.or_else(warning).map(|at| PAGES[at].1)
}

/// Every code with the title of its page.
pub fn codes() -> impl Iterator<Item = (&'static str, &'static str)> {
    PAGES.iter().map(|(code, page)| (*code, page.lines().next().unwrap_or_default().trim_start_matches("# ")))
}

/// The known code that is nearest by its number, where one of the same room (the same hundred) is near enough to have been
/// meant.
pub fn nearest(code: &str) -> Option<&'static str> {
    let wanted: i64 = tidy(code).trim_start_matches(|c: char| c.is_ascii_alphabetic()).parse().ok()?;
    let number = |known: &str| known[1..].parse::<i64>().unwrap_or(i64::MAX / 2);
    let near = |known: &&str| number(known) / 100 == wanted / 100 && (number(known) - wanted).abs() <= 9;
    PAGES.iter().map(|(known, _)| *known).filter(near).min_by_key(|known| (number(known) - wanted).abs())
}

/// `312` → `E0312`.
fn tidy(code: &str) -> String {
    let code = code.trim().to_ascii_uppercase();
    match code.parse::<u16>() {
        Ok(number) => format!("E{number:04}"),
        Err(_) => code,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_are_in_order_and_found_as_people_write_them() {
        assert!(PAGES.windows(2).all(|pair| pair[0].0 < pair[1].0));
        assert!(page("E0312").is_some_and(|page| page.starts_with("# ")));
        assert_eq!(page("e0312"), page("312"));
        assert_eq!(page("W0450"), page("450"));
        assert_eq!(page("E0298"), None);
        assert_eq!(page("hello"), None);
    }

    #[test]
    fn the_nearest_code_is_offered() {
        assert_eq!(nearest("E0313"), Some("E0312"));
        assert_eq!(nearest("E0318x"), None);
        assert_eq!(nearest("E9999"), None);
        assert_eq!(nearest("E0399"), None);
        assert_eq!(nearest("hello"), None);
    }
}
