"""Languages of the generated corpus: the invented one, and real ones that the extra ``voices`` speaks."""

from dataclasses import dataclass

INVENTED = "invented"
"""The language without a dictionary that needs no further library."""


@dataclass(frozen=True)
class Language:
    """A real language."""

    name: str
    title: str
    dialects: tuple[str, ...]
    """Voices of eSpeak NG; each recording has one of them."""


LANGUAGES: dict[str, Language] = {
    language.name: language
    for language in (
        Language("en", "English", ("en", "en-us", "en-gb-x-rp", "en-gb-scotland", "en-us-nyc")),
        Language("de", "German", ("de",)),
        Language("es", "Spanish", ("es", "es-419")),
        Language("fr", "French", ("fr", "fr-be", "fr-ch")),
        Language("it", "Italian", ("it",)),
    )
}
"""The real languages by code."""

LANGUAGE_NAMES = (INVENTED, *LANGUAGES)
